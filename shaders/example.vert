#version 300 es
// SPDX-License-Identifier: MIT
// A vertex shader with four influences a vertex. The line of #include is for the engine, or whoever, to replace.
precision highp float;
precision highp int;

#include "sinew.glsl"

uniform int method;         // SINEW_LBS, SINEW_DQ or SINEW_COR
uniform int second_method;  // what the painted share mixes in; the first again: no mix
uniform mat4 clip_from_armature;

in vec3 position;
in vec3 normal;
in vec3 centre;
in float share;
in uvec4 joints;
in vec4 weights;

out vec3 skinned_position;
out vec3 skinned_normal;

void main() {
    int bones[4] = int[4](int(joints.x), int(joints.y), int(joints.z), int(joints.w));
    float own[4] = float[4](weights.x, weights.y, weights.z, weights.w);
    skinned_position = sinew_mix(method, second_method, share, position, centre, bones, own);
    skinned_normal = sinew_normal(normal, bones, own);
    gl_Position = clip_from_armature * vec4(skinned_position, 1.0);
}
