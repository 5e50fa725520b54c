// SPDX-License-Identifier: MIT
// Linear blending, dual quaternions, centres of rotation and the painted mix of two, as Sinew computes them in Blender.
// For WGSL; copy this file before your entry points. docs/engines.md has the layout.
//
// Points, centres and bones are in one space, that of the armature.

// Influences of a vertex; those that it lacks have the weight 0. In their order the signs of quaternions are chosen.
const SINEW_INFLUENCES: u32 = 4u;

// row0 to row2: the 3x4 matrix that takes the bone's rest pose to its pose; rotation: that in it as a unit quaternion
// x, y, z, w. 64 bytes.
struct SinewBone {
    row0: vec4f,
    row1: vec4f,
    row2: vec4f,
    rotation: vec4f,
}
@group(0) @binding(0) var<storage, read> sinew_bones: array<SinewBone>;

struct SinewInfluences {
    bones: array<u32, SINEW_INFLUENCES>,
    weights: array<f32, SINEW_INFLUENCES>,
}

const SINEW_LBS: u32 = 0u;
const SINEW_DQ: u32 = 1u;
const SINEW_COR: u32 = 2u;

// A vertex whose weights have no larger sum stays where it is.
const SINEW_LEAST_WEIGHT: f32 = 1e-4;

fn sinew_moved(bone: u32, x: vec3f) -> vec3f {
    let p = vec4f(x, 1.0);
    return vec3f(dot(sinew_bones[bone].row0, p), dot(sinew_bones[bone].row1, p), dot(sinew_bones[bone].row2, p));
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

// The rotation of the blend, a unit quaternion: each bone's in the hemisphere of the sum of those before it. That sum never
// vanishes where a weight is above 0.
fn sinew_rotation(own: SinewInfluences) -> vec4f {
    var influences = own;
    var sum = vec4f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let q = sinew_bones[influences.bones[i]].rotation;
        let weight = influences.weights[i];
        sum += select(weight, -weight, dot(q, sum) < 0.0) * q;
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
fn sinew_dq(x: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    if !(sinew_sum(own) > SINEW_LEAST_WEIGHT) { return x; }
    var real = vec4f(0.0);
    var dual = vec4f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let q = sinew_bones[influences.bones[i]].rotation;
        let t = sinew_moved(influences.bones[i], x) - sinew_rotate(q, x);
        let weight = influences.weights[i];
        let signed = select(weight, -weight, dot(q, real) < 0.0);
        real += signed * q;
        dual += 0.5 * signed * vec4f(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
    }
    let size = length(real);
    real /= size;
    dual /= size;
    let translation = 2.0 * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
    return sinew_rotate(real, x) + translation;
}

// Rotated by the blend about a centre of the vertex's own, which linear blending moves.
fn sinew_cor(x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    var influences = own;
    let total = sinew_sum(own);
    if !(total > SINEW_LEAST_WEIGHT) { return x; }
    let from_centre = x - centre;
    var sum = vec3f(0.0);
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let bone = influences.bones[i];
        sum += influences.weights[i] * (sinew_moved(bone, x) - sinew_rotate(sinew_bones[bone].rotation, from_centre));
    }
    return sum / total + sinew_rotate(sinew_rotation(own), from_centre);
}

// By a method of these three; lbs and dq do not read the centre.
fn sinew_skin(method: u32, x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    if method == SINEW_DQ { return sinew_dq(x, own); }
    if method == SINEW_COR { return sinew_cor(x, centre, own); }
    return sinew_lbs(x, own);
}

// The painted mix: share 0 is all of the first method, 1 all of the second.
fn sinew_mix(first: u32, second: u32, share: f32, x: vec3f, centre: vec3f, own: SinewInfluences) -> vec3f {
    let a = sinew_skin(first, x, centre, own);
    if first == second || share <= 0.0 { return a; }
    return mix(a, sinew_skin(second, x, centre, own), min(share, 1.0));
}

// A normal or a tangent, moved by the rotation of the blend: what dq and cor do to it where bones are not scaled.
fn sinew_normal(normal: vec3f, own: SinewInfluences) -> vec3f {
    if !(sinew_sum(own) > SINEW_LEAST_WEIGHT) { return normal; }
    return sinew_rotate(sinew_rotation(own), normal);
}
