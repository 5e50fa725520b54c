#version 300 es
// SPDX-License-Identifier: MIT
// A vertex shader with four influences a vertex. The line of #include is for the engine, or whoever, to replace.
precision highp float;
precision highp int;

#include "sinew.glsl"

uniform int method;         // SINEW_LBS, SINEW_DQ or SINEW_COR, the last two with SINEW_HIERARCHY or without
uniform int second_method;  // what the painted share mixes in; the first again: no mix
uniform int bulge_form;     // SINEW_CONTINUOUS or SINEW_KIM_HAN
uniform mat4 clip_from_armature;

in vec3 position;
in vec3 normal;
in vec3 centre;
in float share;
in vec2 stages;  // amounts of Twist Spread and Limit Bulge, 0 without the stage
in uvec4 joints;
in vec4 weights;

out vec3 skinned_position;
out vec3 skinned_normal;

void main() {
    int bones[4] = int[4](int(joints.x), int(joints.y), int(joints.z), int(joints.w));
    float own[4] = float[4](weights.x, weights.y, weights.z, weights.w);
    vec3 moved = sinew_mix(method, second_method, share, position, centre, bones, own);
    float linear_share = sinew_linear_share(method, second_method, share);
    moved = sinew_twist_spread(moved, linear_share, stages.x, position, bones, own);
    skinned_position = sinew_bulge_limit(moved, bulge_form, stages.y, position, bones, own);
    skinned_normal = sinew_normal(method, normal, bones, own);
    skinned_normal = sinew_twist_normal(skinned_normal, stages.x, position, bones, own);
    gl_Position = clip_from_armature * vec4(skinned_position, 1.0);
}
