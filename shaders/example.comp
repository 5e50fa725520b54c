#version 310 es
// SPDX-License-Identifier: MIT
// A compute shader with eight influences a vertex; bones and vertices are in storage buffers.
precision highp float;
precision highp int;

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer SinewBones { vec4 sinew_bones[]; };

#define SINEW_INFLUENCES 8
#define SINEW_BONES_DECLARED
#define SINEW_BONE(bone, k) sinew_bones[8 * (bone) + (k)]
#include "sinew.glsl"

struct Vertex {
    vec4 position_share;  // x, y, z, then the painted share of the second method
    vec4 centre_twist;    // x, y, z of the centre of rotation, then how much Twist Spread moves the vertex
    vec4 bulge;           // x: how much Limit Bulge does
    uvec4 bones[SINEW_INFLUENCES / 4];
    vec4 weights[SINEW_INFLUENCES / 4];
};
layout(std430, binding = 1) readonly buffer Vertices { Vertex vertices[]; };
layout(std430, binding = 2) writeonly buffer Skinned { vec4 skinned[]; };

uniform int method;
uniform int second_method;
uniform int bulge_form;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= uint(vertices.length())) return;
    int bones[SINEW_INFLUENCES];
    float weights[SINEW_INFLUENCES];
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        bones[i] = int(vertices[index].bones[i / 4][i % 4]);
        weights[i] = vertices[index].weights[i / 4][i % 4];
    }
    vec3 x = vertices[index].position_share.xyz;
    float share = vertices[index].position_share.w;
    vec4 centre_twist = vertices[index].centre_twist;
    vec3 moved = sinew_mix(method, second_method, share, x, centre_twist.xyz, bones, weights);
    float linear_share = sinew_linear_share(method, second_method, share);
    moved = sinew_twist_spread(moved, linear_share, centre_twist.w, x, bones, weights);
    skinned[index] = vec4(sinew_bulge_limit(moved, bulge_form, vertices[index].bulge.x, x, bones, weights), 1.0);
}
