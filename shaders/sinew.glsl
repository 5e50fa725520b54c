// SPDX-License-Identifier: MIT
// Linear blending, dual quaternions, centres of rotation and the painted mix of two, as Sinew computes them in Blender.
// For GLSL ES 3.00 and GLSL 3.30 and later; copy this file behind your #version line. docs/engines.md has the layout.
//
// Points, centres and bones are in one space, that of the armature.

// Influences of a vertex; those that it lacks have the weight 0. In their order the signs of quaternions are chosen.
#ifndef SINEW_INFLUENCES
#define SINEW_INFLUENCES 4
#endif

// The bones: four vectors each. 0 to 2 are the rows of the 3x4 matrix that takes the bone's rest pose to its pose; 3 is the
// rotation in it as a unit quaternion x, y, z, w. Here an RGBA32F texture, four texels wide, one row a bone; define
// SINEW_BONE(bone, k) and SINEW_BONES_DECLARED to read them from elsewhere.
#ifndef SINEW_BONES_DECLARED
uniform highp sampler2D sinew_bones;
#define SINEW_BONE(bone, k) texelFetch(sinew_bones, ivec2(k, bone), 0)
#endif

const int SINEW_LBS = 0;
const int SINEW_DQ = 1;
const int SINEW_COR = 2;

// A vertex whose weights have no larger sum stays where it is.
const float SINEW_LEAST_WEIGHT = 1e-4;

vec3 sinew_moved(int bone, vec3 x) {
    vec4 p = vec4(x, 1.0);
    return vec3(dot(SINEW_BONE(bone, 0), p), dot(SINEW_BONE(bone, 1), p), dot(SINEW_BONE(bone, 2), p));
}

vec3 sinew_rotate(vec4 q, vec3 v) {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

float sinew_sum(float weights[SINEW_INFLUENCES]) {
    float sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) sum += weights[i];
    return sum;
}

// The rotation of the blend, a unit quaternion: each bone's in the hemisphere of the sum of those before it. That sum never
// vanishes where a weight is above 0.
vec4 sinew_rotation(int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        sum += (dot(q, sum) < 0.0 ? -weights[i] : weights[i]) * q;
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
vec3 sinew_dq(vec3 x, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return x;
    vec4 real = vec4(0.0);
    vec4 dual = vec4(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        vec3 t = sinew_moved(bones[i], x) - sinew_rotate(q, x);
        float weight = dot(q, real) < 0.0 ? -weights[i] : weights[i];
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
vec3 sinew_cor(vec3 x, vec3 centre, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(total > SINEW_LEAST_WEIGHT)) return x;
    vec3 from_centre = x - centre;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        vec4 q = SINEW_BONE(bones[i], 3);
        sum += weights[i] * (sinew_moved(bones[i], x) - sinew_rotate(q, from_centre));
    }
    return sum / total + sinew_rotate(sinew_rotation(bones, weights), from_centre);
}

// By a method of these three; lbs and dq do not read the centre.
vec3 sinew_skin(int method, vec3 x, vec3 centre, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (method == SINEW_DQ) return sinew_dq(x, bones, weights);
    if (method == SINEW_COR) return sinew_cor(x, centre, bones, weights);
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
vec3 sinew_normal(vec3 normal, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return normal;
    return sinew_rotate(sinew_rotation(bones, weights), normal);
}
