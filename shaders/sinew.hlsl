// SPDX-License-Identifier: MIT
// Linear blending, dual quaternions, centres of rotation and the painted mix of two, as Sinew computes them in Blender.
// For HLSL of shader model 5 and later; include this file before your entry points. docs/engines.md has the layout.
//
// Points, centres and bones are in one space, that of the armature.

// Influences of a vertex; those that it lacks have the weight 0. In their order the signs of quaternions are chosen.
#ifndef SINEW_INFLUENCES
#define SINEW_INFLUENCES 4
#endif

// The bones: four vectors each. 0 to 2 are the rows of the 3x4 matrix that takes the bone's rest pose to its pose; 3 is the
// rotation in it as a unit quaternion x, y, z, w. Here a buffer, one bone after the other; define SINEW_BONE(bone, k) and
// SINEW_BONES_DECLARED to read them from elsewhere.
#ifndef SINEW_BONES_DECLARED
StructuredBuffer<float4> sinew_bones;
#define SINEW_BONE(bone, k) sinew_bones[4 * (bone) + (k)]
#endif

static const int SINEW_LBS = 0;
static const int SINEW_DQ = 1;
static const int SINEW_COR = 2;

// A vertex whose weights have no larger sum stays where it is.
static const float SINEW_LEAST_WEIGHT = 1e-4;

float3 sinew_moved(int bone, float3 x) {
    float4 p = float4(x, 1.0);
    return float3(dot(SINEW_BONE(bone, 0), p), dot(SINEW_BONE(bone, 1), p), dot(SINEW_BONE(bone, 2), p));
}

float3 sinew_rotate(float4 q, float3 v) {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

float sinew_sum(float weights[SINEW_INFLUENCES]) {
    float sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) sum += weights[i];
    return sum;
}

// The rotation of the blend, a unit quaternion: each bone's in the hemisphere of the sum of those before it. That sum never
// vanishes where a weight is above 0.
float4 sinew_rotation(int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    float4 sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float4 q = SINEW_BONE(bones[i], 3);
        sum += (dot(q, sum) < 0.0 ? -weights[i] : weights[i]) * q;
    }
    return normalize(sum);
}

// Linear blending.
float3 sinew_lbs(float3 x, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(total > SINEW_LEAST_WEIGHT)) return x;
    float3 sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) sum += weights[i] * (sinew_moved(bones[i], x) - x);
    return x + sum / total;
}

// Dual quaternions; each bone has the translation that takes x where the whole bone takes it, scale included.
float3 sinew_dq(float3 x, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return x;
    float4 real = 0.0;
    float4 dual = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float4 q = SINEW_BONE(bones[i], 3);
        float3 t = sinew_moved(bones[i], x) - sinew_rotate(q, x);
        float weight = dot(q, real) < 0.0 ? -weights[i] : weights[i];
        real += weight * q;
        dual += 0.5 * weight * float4(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
    }
    float size = length(real);
    real /= size;
    dual /= size;
    float3 translation = 2.0 * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
    return sinew_rotate(real, x) + translation;
}

// Rotated by the blend about a centre of the vertex's own, which linear blending moves.
float3 sinew_cor(float3 x, float3 centre, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    float total = sinew_sum(weights);
    if (!(total > SINEW_LEAST_WEIGHT)) return x;
    float3 from_centre = x - centre;
    float3 sum = 0.0;
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        float4 q = SINEW_BONE(bones[i], 3);
        sum += weights[i] * (sinew_moved(bones[i], x) - sinew_rotate(q, from_centre));
    }
    return sum / total + sinew_rotate(sinew_rotation(bones, weights), from_centre);
}

// By a method of these three; lbs and dq do not read the centre.
float3 sinew_skin(int method, float3 x, float3 centre, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (method == SINEW_DQ) return sinew_dq(x, bones, weights);
    if (method == SINEW_COR) return sinew_cor(x, centre, bones, weights);
    return sinew_lbs(x, bones, weights);
}

// The painted mix: share 0 is all of the first method, 1 all of the second.
float3 sinew_mix(int first, int second, float share, float3 x, float3 centre, int bones[SINEW_INFLUENCES],
                 float weights[SINEW_INFLUENCES]) {
    float3 a = sinew_skin(first, x, centre, bones, weights);
    if (first == second || share <= 0.0) return a;
    return lerp(a, sinew_skin(second, x, centre, bones, weights), min(share, 1.0));
}

// A normal or a tangent, moved by the rotation of the blend: what dq and cor do to it where bones are not scaled.
float3 sinew_normal(float3 normal, int bones[SINEW_INFLUENCES], float weights[SINEW_INFLUENCES]) {
    if (!(sinew_sum(weights) > SINEW_LEAST_WEIGHT)) return normal;
    return sinew_rotate(sinew_rotation(bones, weights), normal);
}
