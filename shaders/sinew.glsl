// SPDX-License-Identifier: MIT
// Linear blending, dual quaternions, centres of rotation, the painted mix of two, and the stages Twist Spread and Limit
// Bulge, as Sinew computes them in Blender.
// For GLSL ES 3.00 and GLSL 3.30 and later; copy this file behind your #version line. docs/engines.md has the layout.
//
// Points, centres and bones are in one space, that of the armature.

// Influences of a vertex; those that it lacks have the weight 0. In their order the signs of quaternions are chosen.
#ifndef SINEW_INFLUENCES
#define SINEW_INFLUENCES 4
#endif

// The bones: eight vectors each. 0 to 2 are the rows of the 3x4 matrix that takes a bone's rest pose to its pose, 3 is
// the rotation in it as a unit quaternion x, y, z, w; 4 to 7 are for the stages. Here an RGBA32F texture, eight texels
// wide, one row a bone; define SINEW_BONE(bone, k) and SINEW_BONES_DECLARED to read them from elsewhere.
#ifndef SINEW_BONES_DECLARED
uniform highp sampler2D sinew_bones;
#define SINEW_BONE(bone, k) texelFetch(sinew_bones, ivec2(k, bone), 0)
#endif

const int SINEW_LBS = 0;
const int SINEW_DQ = 1;
const int SINEW_COR = 2;
// Added to SINEW_DQ or SINEW_COR: quaternions keep the signs that the buffer has, those of the hierarchy.
const int SINEW_HIERARCHY = 4;

// A vertex whose weights have no larger sum stays where it is.
const float SINEW_LEAST_WEIGHT = 1e-4;

// A point by the motion of a bone, where p.w is 1; a vector, where it is 0.
vec3 sinew_by_bone(int bone, vec4 p) {
    return vec3(dot(SINEW_BONE(bone, 0), p), dot(SINEW_BONE(bone, 1), p), dot(SINEW_BONE(bone, 2), p));
}

vec3 sinew_moved(int bone, vec3 x) {
    return sinew_by_bone(bone, vec4(x, 1.0));
}

vec3 sinew_rotate(vec4 q, vec3 v) {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

float sinew_sum(float weights[SINEW_INFLUENCES]) {
    float sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) sum += weights[i];
    return sum;
}

// The weight of a quaternion in a sum: negative where that brings it nearer to the sum so far, unless signs are kept.
float sinew_signed(float weight, vec4 q, vec4 sum, bool keeps_signs) {
    return !keeps_signs && dot(q, sum) < 0.0 ? -weight : weight;
}

// The rotation of the blend, a unit quaternion.
vec4 sinew_rotation(bool keeps_signs, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        sum += sinew_signed(weights[i], q, sum, keeps_signs) * q;
    }
    return normalize(sum);
}

// Linear blending.
vec3 sinew_lbs(vec3 x, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(total > SINEW_LEAST_WEIGHT)) return x;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) sum += weights[i] * (sinew_moved(bones[i], x) - x);
    return x + sum / total;
}

// Dual quaternions; each bone has the translation that takes x where the whole bone takes it, scale included.
vec3 sinew_dq(bool keeps_signs, vec3 x, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return x;
    vec4 real = vec4(0.0);
    vec4 dual = vec4(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        vec3 t = sinew_moved(bones[i], x) - sinew_rotate(q, x);
        float weight = sinew_signed(weights[i], q, real, keeps_signs);
        real += weight * q;
        dual += 0.5 * weight * vec4(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
    }
    float size = length(real);
    real /= size;
    dual /= size;
    vec3 translation = 2.0 * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
    return sinew_rotate(real, x) + translation;
}

// Rotated by the blend about a centre of the vertex's own, which linear blending moves.
vec3 sinew_cor(bool keeps_signs, vec3 x, vec3 centre, int bones[SINEW_INFLUENCES],
               float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(total > SINEW_LEAST_WEIGHT)) return x;
    vec3 from_centre = x - centre;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        sum += weights[i] * (sinew_moved(bones[i], x) - sinew_rotate(q, from_centre));
    }
    return sum / total + sinew_rotate(sinew_rotation(keeps_signs, bones, weights), from_centre);
}

// By a method of these three; lbs and dq do not read the centre.
vec3 sinew_skin(int method, vec3 x, vec3 centre, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    bool keeps_signs = method >= SINEW_HIERARCHY;
    int blend = keeps_signs ? method - SINEW_HIERARCHY : method;
    if (blend == SINEW_DQ) return sinew_dq(keeps_signs, x, bones, weights);
    if (blend == SINEW_COR) return sinew_cor(keeps_signs, x, centre, bones, weights);
    return sinew_lbs(x, bones, weights);
}

// The painted mix: share 0 is all of the first method, 1 all of the second.
vec3 sinew_mix(int first, int second, float share, vec3 x, vec3 centre, int bones[SINEW_INFLUENCES],
               float weights[SINEW_INFLUENCES]) {
    vec3 a = sinew_skin(first, x, centre, bones, weights);
    if (first == second || share <= 0.0) return a;
    return mix(a, sinew_skin(second, x, centre, bones, weights), min(share, 1.0));
}

// A normal or a tangent, moved by the rotation of the blend: what dq and cor do to it where bones are not scaled.
vec3 sinew_normal(int method, vec3 normal, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return normal;
    return sinew_rotate(sinew_rotation(method >= SINEW_HIERARCHY, bones, weights), normal);
}

// --- Twist Spread, the first stage after the blend: spreads the twist of a bone against the next along the bone.
// Vector 6 of such a bone has the angle at its head, that at its tail, and a number above those of the bones that carry
// it; it is 0 for other bones. Vector 5 has the curve between the angles in w.
//
// Matrices do not tell of more than half a turn. Where something else does, vector 7 has its whole turns beyond that in
// w, and vector 6 the part of the twist that is spread. Then each bone has a number in x of 7, and the bones from the
// number y to before z are those beyond the twist.

// How much of a blend is linear.
float sinew_linear_share(int first, int second, float share) {
    return mix(first == SINEW_LBS ? 1.0 : 0.0, second == SINEW_LBS ? 1.0 : 0.0, clamp(share, 0.0, 1.0));
}

// The place among the influences of the twisted bone with the largest number below `before`; -1 for none.
int sinew_twisted(float before, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    int found = -1;
    float number = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float own = weights[i] > 0.0 ? SINEW_BONE(bones[i], 6).z : 0.0;
        if (own > number && own < before) {
            found = i;
            number = own;
        }
    }
    return found;
}

// The twist of a bone at a rest point.
float sinew_twist(int bone, vec3 x) {
    vec4 along = SINEW_BONE(bone, 5);
    vec2 angles = SINEW_BONE(bone, 6).xy;
    float share = clamp(dot(x - SINEW_BONE(bone, 4).xyz, along.xyz) / dot(along.xyz, along.xyz), 0.0, 1.0);
    return mix(angles.x, angles.y, share + along.w * share * (1.0 - share));
}

// The direction of a posed bone, about which it twists; 0 where it has none.
vec3 sinew_posed_axis(int bone) {
    vec3 axis = sinew_by_bone(bone, vec4(SINEW_BONE(bone, 5).xyz, 0.0));
    float volume = dot(SINEW_BONE(bone, 0).xyz, cross(SINEW_BONE(bone, 1).xyz, SINEW_BONE(bone, 2).xyz));
    float size = length(axis) * (volume < 0.0 ? -1.0 : 1.0);
    return size == 0.0 ? axis : axis / size;
}

// Of an angle up to a quarter turn. The functions that drivers bring may be off by 1e-4.
float sinew_sine(float x) {
    float y = x * x;
    return x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0)))));
}

// What a rotation about an axis adds to a vector.
vec3 sinew_spun(vec3 axis, float angle, vec3 v) {
    float half_angle = 0.5 * angle - 3.14159265 * round(angle / 6.28318531);
    vec3 q = sinew_sine(half_angle) * axis;
    return 2.0 * cross(q, cross(q, v) + sinew_sine(1.57079633 - abs(half_angle)) * v);
}

// What a blend the shorter way leaves out where bones are whole turns farther apart.
float sinew_left_out(int bone, float amount, float total, int bones[SINEW_INFLUENCES],
                     float weights[SINEW_INFLUENCES]) {
    vec4 turns = SINEW_BONE(bone, 7);
    if (turns.w == 0.0 || !(amount * SINEW_BONE(bone, 6).w > 0.5)) return 0.0;
    float beyond = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float number = SINEW_BONE(bones[i], 7).x;
        if (number >= turns.y && number < turns.z) beyond += weights[i];
    }
    return beyond > 0.0 && beyond < total ? 4.0 * turns.w * atan(beyond, total - beyond) : 0.0;
}

// moved         by the blend
// linear_share  of sinew_linear_share()
// amount        of the vertex, 0 to 1
// x             at rest
vec3 sinew_twist_spread(vec3 moved, float linear_share, float amount, vec3 x, int bones[SINEW_INFLUENCES],
                        float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(amount > 0.0 && total > SINEW_LEAST_WEIGHT)) return moved;
    int i = sinew_twisted(1e9, bones, weights);
    while (i >= 0) {
        int bone = bones[i];
        float weight = weights[i] / total;
        float angle = amount * sinew_twist(bone, x);
        vec3 head = SINEW_BONE(bone, 4).xyz;
        vec3 axis = sinew_posed_axis(bone);
        // Linear: by the bone's matrix after a rotation at rest. Other blends are rotated about the posed bone; where
        // it is scaled, they keep its scaled shape.
        vec3 own = sinew_by_bone(bone, vec4(sinew_spun(normalize(SINEW_BONE(bone, 5).xyz), angle, x - head), 0.0));
        float left_out = sinew_left_out(bone, amount, total, bones, weights);
        vec3 by = sinew_spun(axis, weight * angle + left_out, moved - sinew_moved(bone, head));
        by += weight * (own - sinew_spun(axis, angle, sinew_by_bone(bone, vec4(x - head, 0.0))));
        moved += mix(dot(axis, axis) > 0.0 ? by : vec3(0.0), weight * own, linear_share);
        i = sinew_twisted(SINEW_BONE(bone, 6).z, bones, weights);
    }
    return moved;
}

// The same rotations for a normal or a tangent, after sinew_normal().
vec3 sinew_twist_normal(vec3 normal, float amount, vec3 x, int bones[SINEW_INFLUENCES],
                        float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(amount > 0.0 && total > SINEW_LEAST_WEIGHT)) return normal;
    int i = sinew_twisted(1e9, bones, weights);
    while (i >= 0) {
        float angle = weights[i] / total * amount * sinew_twist(bones[i], x);
        angle += sinew_left_out(bones[i], amount, total, bones, weights);
        normal += sinew_spun(sinew_posed_axis(bones[i]), angle, normal);
        i = sinew_twisted(SINEW_BONE(bones[i], 6).z, bones, weights);
    }
    return normal;
}

// --- Limit Bulge, the next stage: moves a vertex of several bones back where it is farther from them than at rest.
// Vector 4 of a bone is its head at rest, vector 5 goes from there to its tail; 4 has in w how much the motion of the
// bone stretches what is across it.

const int SINEW_CONTINUOUS = 0;
const int SINEW_KIM_HAN = 1;

// From a point to the nearest of a segment.
vec3 sinew_to_segment(vec3 head, vec3 along, vec3 p) {
    float squared = dot(along, along);
    float share = squared > 0.0 ? clamp(dot(p - head, along) / squared, 0.0, 1.0) : 0.0;
    return head + share * along - p;
}

// moved   by what came before
// form    SINEW_CONTINUOUS, or SINEW_KIM_HAN for the distance to the heaviest bone alone
// amount  strength times that of the vertex, 0 to 1
// x       at rest
vec3 sinew_bulge_limit(vec3 moved, int form, float amount, vec3 x, int bones[SINEW_INFLUENCES],
                       float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(amount > 0.0 && total > SINEW_LEAST_WEIGHT)) return moved;
    int heaviest = 0;
    int count = 0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        if (weights[i] > weights[heaviest]) heaviest = i;
        if (weights[i] > 0.0) ++count;
    }
    if (count < 2) return moved;
    vec3 to_bones = vec3(0.0);
    float at_rest = 0.0;
    float stretch = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float weight = form == SINEW_KIM_HAN ? (i == heaviest ? 1.0 : 0.0) : weights[i] / total;
        if (weight == 0.0) continue;
        vec4 head = SINEW_BONE(bones[i], 4);
        vec3 along = SINEW_BONE(bones[i], 5).xyz;
        vec3 posed = sinew_by_bone(bones[i], vec4(along, 0.0));
        to_bones += weight * sinew_to_segment(sinew_moved(bones[i], head.xyz), posed, moved);
        at_rest += weight * length(sinew_to_segment(head.xyz, along, x));
        stretch += weight * head.w;
    }
    // Rounding leaves the rest pose as it is.
    float allowed = 1.000001 * at_rest * stretch;
    float now = length(to_bones);
    return now > allowed ? moved + amount * (1.0 - allowed / now) * to_bones : moved;
}
