// SPDX-License-Identifier: MIT
// Linear blending, dual quaternions, centres of rotation, the painted mix of two, and the stages Twist Spread and Limit
// Bulge, as Sinew computes them in Blender.
// For WGSL; copy this file before your entry points. docs/engines.md has the layout.
//
// Points, centres and bones are in one space, that of the armature.

// Influences of a vertex; those that it lacks have the weight 0. In their order the signs of quaternions are chosen.
const SINEW_INFLUENCES: u32 = 4u;

// row0 to row2: the 3x4 matrix that takes the bone's rest pose to its pose; rotation: that in it as a unit quaternion
// x, y, z, w; the rest is for the stages. 128 bytes.
struct SinewBone {
    row0: vec4f,
    row1: vec4f,
    row2: vec4f,
    rotation: vec4f,
    head: vec4f,
    along: vec4f,
    twist: vec4f,
    turns: vec4f,
}
@group(0) @binding(0) var<storage, read> sinew_bones: array<SinewBone>;

struct SinewInfluences {
    bones: array<u32, SINEW_INFLUENCES>,
    weights: array<f32, SINEW_INFLUENCES>,
}

const SINEW_LBS: u32 = 0u;
const SINEW_DQ: u32 = 1u;
const SINEW_COR: u32 = 2u;
// Added to SINEW_DQ or SINEW_COR: quaternions keep the signs that the buffer has, those of the hierarchy.
const SINEW_HIERARCHY: u32 = 4u;

// A vertex whose weights have no larger sum stays where it is.
const SINEW_LEAST_WEIGHT: f32 = 1e-4;

// A point by the motion of a bone, where p.w is 1; a vector, where it is 0.
fn sinew_by_bone(bone: u32, p: vec4f) -> vec3f {
    return vec3f(dot(sinew_bones[bone].row0, p), dot(sinew_bones[bone].row1, p), dot(sinew_bones[bone].row2, p));
}

fn sinew_moved(bone: u32, x: vec3f) -> vec3f {
    return sinew_by_bone(bone, vec4f(x, 1.0));
}

fn sinew_rotate(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

fn sinew_sum(own: SinewInfluences) -> f32 {
    var influences = own;
    var sum = 0.0;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) { sum += influences.weights[i]; }
    return sum;
}

// The weight of a quaternion in a sum: negative where that brings it nearer to the sum so far, unless signs are kept.
fn sinew_signed(weight: f32, q: vec4f, sum: vec4f, keeps_signs: bool) -> f32 {
    return select(weight, -weight, !keeps_signs && dot(q, sum) < 0.0);
}

// The rotation of the blend, a unit quaternion.
fn sinew_rotation(keeps_signs: bool, own: SinewInfluences) -> vec4f {
    var influences = own;
    var sum = vec4f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let q = sinew_bones[influences.bones[i]].rotation;
        sum += sinew_signed(influences.weights[i], q, sum, keeps_signs) * q;
    }
    return normalize(sum);
}

// Linear blending.
fn sinew_lbs(x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    let total = sinew_sum(own);
    if !(total > SINEW_LEAST_WEIGHT) { return x; }
    var sum = vec3f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        sum += influences.weights[i] * (sinew_moved(influences.bones[i], x) - x);
    }
    return x + sum / total;
}

// Dual quaternions; each bone has the translation that takes x where the whole bone takes it, scale included.
fn sinew_dq(keeps_signs: bool, x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    if !(sinew_sum(own) > SINEW_LEAST_WEIGHT) { return x; }
    var real = vec4f(0.0);
    var dual = vec4f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let q = sinew_bones[influences.bones[i]].rotation;
        let t = sinew_moved(influences.bones[i], x) - sinew_rotate(q, x);
        let weight = sinew_signed(influences.weights[i], q, real, keeps_signs);
        real += weight * q;
        dual += 0.5 * weight * vec4f(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
    }
    let size = length(real);
    real /= size;
    dual /= size;
    let translation = 2.0 * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
    return sinew_rotate(real, x) + translation;
}

// Rotated by the blend about a centre of the vertex's own, which linear blending moves.
fn sinew_cor(keeps_signs: bool, x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    let total = sinew_sum(own);
    if !(total > SINEW_LEAST_WEIGHT) { return x; }
    let from_centre = x - centre;
    var sum = vec3f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let bone = influences.bones[i];
        sum += influences.weights[i] * (sinew_moved(bone, x) - sinew_rotate(sinew_bones[bone].rotation, from_centre));
    }
    return sum / total + sinew_rotate(sinew_rotation(keeps_signs, own), from_centre);
}

// By a method of these three; lbs and dq do not read the centre.
fn sinew_skin(method: u32, x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    let keeps_signs = method >= SINEW_HIERARCHY;
    let blend = select(method, method - SINEW_HIERARCHY, keeps_signs);
    if blend == SINEW_DQ { return sinew_dq(keeps_signs, x, own); }
    if blend == SINEW_COR { return sinew_cor(keeps_signs, x, centre, own); }
    return sinew_lbs(x, own);
}

// The painted mix: share 0 is all of the first method, 1 all of the second.
fn sinew_mix(first: u32, second: u32, share: f32, x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    let a = sinew_skin(first, x, centre, own);
    if first == second || share <= 0.0 { return a; }
    return mix(a, sinew_skin(second, x, centre, own), min(share, 1.0));
}

// A normal or a tangent, moved by the rotation of the blend: what dq and cor do to it where bones are not scaled.
fn sinew_normal(method: u32, normal: vec3f, own: SinewInfluences) -> vec3f {
    if !(sinew_sum(own) > SINEW_LEAST_WEIGHT) { return normal; }
    return sinew_rotate(sinew_rotation(method >= SINEW_HIERARCHY, own), normal);
}

// --- Twist Spread, the first stage after the blend: spreads the twist of a bone against the next along the bone. The
// `twist` of such a bone has the angle at its head, that at its tail, and a number above those of the bones that carry
// it; it is 0 for other bones. `along` has the curve between the angles in w.
//
// Matrices do not tell of more than half a turn. Where something else does, `turns` has its whole turns beyond that in
// w, and `twist` the part of the twist that is spread. Then each bone has a number in x of `turns`, and the bones from
// the number y to before z are those beyond the twist.

// How much of a blend is linear.
fn sinew_linear_share(first: u32, second: u32, share: f32) -> f32 {
    return mix(f32(first == SINEW_LBS), f32(second == SINEW_LBS), clamp(share, 0.0, 1.0));
}

// The place among the influences of the twisted bone with the largest number below `before`; -1 for none.
fn sinew_twisted(before: f32, own: SinewInfluences) -> i32 {
    var influences = own;
    var found = -1;
    var number = 0.0;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        if !(influences.weights[i] > 0.0) { continue; }
        let its = sinew_bones[influences.bones[i]].twist.z;
        if its > number && its < before {
            found = i32(i);
            number = its;
        }
    }
    return found;
}

// The twist of a bone at a rest point.
fn sinew_twist(bone: u32, x: vec3f) -> f32 {
    let along = sinew_bones[bone].along;
    let angles = sinew_bones[bone].twist.xy;
    let share = clamp(dot(x - sinew_bones[bone].head.xyz, along.xyz) / dot(along.xyz, along.xyz), 0.0, 1.0);
    return mix(angles.x, angles.y, share + along.w * share * (1.0 - share));
}

// The direction of a posed bone, about which it twists; 0 where it has none.
fn sinew_posed_axis(bone: u32) -> vec3f {
    let axis = sinew_by_bone(bone, vec4f(sinew_bones[bone].along.xyz, 0.0));
    let volume = dot(sinew_bones[bone].row0.xyz, cross(sinew_bones[bone].row1.xyz, sinew_bones[bone].row2.xyz));
    let size = length(axis) * select(1.0, -1.0, volume < 0.0);
    return select(axis / size, axis, size == 0.0);
}

// Of an angle up to a quarter turn. The functions that drivers bring may be off by 1e-4.
fn sinew_sine(x: f32) -> f32 {
    let y = x * x;
    return x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0)))));
}

// What a rotation about an axis adds to a vector.
fn sinew_spun(axis: vec3f, angle: f32, v: vec3f) -> vec3f {
    let half_angle = 0.5 * angle - 3.14159265 * round(angle / 6.28318531);
    let q = sinew_sine(half_angle) * axis;
    return 2.0 * cross(q, cross(q, v) + sinew_sine(1.57079633 - abs(half_angle)) * v);
}

// What a blend the shorter way leaves out where bones are whole turns farther apart.
fn sinew_left_out(bone: u32, amount: f32, total: f32, own: SinewInfluences) -> f32 {
    var influences = own;
    let turns = sinew_bones[bone].turns;
    if turns.w == 0.0 || !(amount * sinew_bones[bone].twist.w > 0.5) { return 0.0; }
    var beyond = 0.0;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let number = sinew_bones[influences.bones[i]].turns.x;
        if number >= turns.y && number < turns.z { beyond += influences.weights[i]; }
    }
    return select(0.0, 4.0 * turns.w * atan2(beyond, total - beyond), beyond > 0.0 && beyond < total);
}

// blended       the point by the blend
// linear_share  of sinew_linear_share()
// amount        of the vertex, 0 to 1
// x             at rest
fn sinew_twist_spread(blended: vec3f, linear_share: f32, amount: f32, x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    var moved = blended;
    let total = sinew_sum(own);
    if !(amount > 0.0 && total > SINEW_LEAST_WEIGHT) { return moved; }
    var i = sinew_twisted(1e9, own);
    while i >= 0 {
        let bone = influences.bones[i];
        let weight = influences.weights[i] / total;
        let angle = amount * sinew_twist(bone, x);
        let head = sinew_bones[bone].head.xyz;
        let axis = sinew_posed_axis(bone);
        // Linear: by the bone's matrix after a rotation at rest. Other blends are rotated about the posed bone; where
        // it is scaled, they keep its scaled shape.
        let spun = sinew_spun(normalize(sinew_bones[bone].along.xyz), angle, x - head);
        let alone = sinew_by_bone(bone, vec4f(spun, 0.0));
        let left_out = sinew_left_out(bone, amount, total, own);
        var by = sinew_spun(axis, weight * angle + left_out, moved - sinew_moved(bone, head));
        by += weight * (alone - sinew_spun(axis, angle, sinew_by_bone(bone, vec4f(x - head, 0.0))));
        moved += mix(select(vec3f(0.0), by, dot(axis, axis) > 0.0), weight * alone, linear_share);
        i = sinew_twisted(sinew_bones[bone].twist.z, own);
    }
    return moved;
}

// The same rotations for a normal or a tangent, after sinew_normal().
fn sinew_twist_normal(normal: vec3f, amount: f32, x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    var rotated = normal;
    let total = sinew_sum(own);
    if !(amount > 0.0 && total > SINEW_LEAST_WEIGHT) { return normal; }
    var i = sinew_twisted(1e9, own);
    while i >= 0 {
        let bone = influences.bones[i];
        let angle = influences.weights[i] / total * amount * sinew_twist(bone, x)
            + sinew_left_out(bone, amount, total, own);
        rotated += sinew_spun(sinew_posed_axis(bone), angle, rotated);
        i = sinew_twisted(sinew_bones[bone].twist.z, own);
    }
    return rotated;
}

// --- Limit Bulge, the next stage: moves a vertex of several bones back where it is farther from them than at rest.
// `head` of a bone is its head at rest, `along` goes from there to its tail; `head` has in w how much the motion of the
// bone stretches what is across it.

const SINEW_CONTINUOUS: u32 = 0u;
const SINEW_KIM_HAN: u32 = 1u;

// From a point to the nearest of a segment.
fn sinew_to_segment(head: vec3f, along: vec3f, p: vec3f) -> vec3f {
    let squared = dot(along, along);
    let share = select(0.0, clamp(dot(p - head, along) / squared, 0.0, 1.0), squared > 0.0);
    return head + share * along - p;
}

// moved   by what came before
// form    SINEW_CONTINUOUS, or SINEW_KIM_HAN for the distance to the heaviest bone alone
// amount  strength times that of the vertex, 0 to 1
// x       at rest
fn sinew_bulge_limit(moved: vec3f, form: u32, amount: f32, x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    let total = sinew_sum(own);
    if !(amount > 0.0 && total > SINEW_LEAST_WEIGHT) { return moved; }
    var heaviest = 0u;
    var count = 0u;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        if influences.weights[i] > influences.weights[heaviest] { heaviest = i; }
        if influences.weights[i] > 0.0 { count++; }
    }
    if count < 2u { return moved; }
    var to_bones = vec3f(0.0);
    var at_rest = 0.0;
    var stretch = 0.0;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let bone = influences.bones[i];
        let weight = select(influences.weights[i] / total, f32(i == heaviest), form == SINEW_KIM_HAN);
        if weight == 0.0 { continue; }
        let head = sinew_bones[bone].head;
        let along = sinew_bones[bone].along.xyz;
        let posed = sinew_by_bone(bone, vec4f(along, 0.0));
        to_bones += weight * sinew_to_segment(sinew_moved(bone, head.xyz), posed, moved);
        at_rest += weight * length(sinew_to_segment(head.xyz, along, x));
        stretch += weight * head.w;
    }
    // Rounding leaves the rest pose as it is.
    let allowed = 1.000001 * at_rest * stretch;
    let now = length(to_bones);
    if !(now > allowed) { return moved; }
    return moved + amount * (1.0 - allowed / now) * to_bones;
}
