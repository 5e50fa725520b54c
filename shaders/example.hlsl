// SPDX-License-Identifier: MIT
// A compute shader; bones and vertices are in buffers. [[vk::binding(n)]] is for Vulkan: leave it out for Direct3D 11.
#define SINEW_BONES_DECLARED
[[vk::binding(0)]] StructuredBuffer<float4> bones_of_frame : register(t0);
#define SINEW_BONE(bone, k) bones_of_frame[8 * (bone) + (k)]
#include "sinew.hlsl"

struct Vertex {
    float3 position;
    float share;
    float3 centre;
    float twist;  // how much Twist Spread moves the vertex
    float bulge;  // the same for Limit Bulge
    float padding[3];
    uint bones[SINEW_INFLUENCES];
    float weights[SINEW_INFLUENCES];
};

struct Skinned {
    float4 position;
    float4 normal;
};

[[vk::binding(1)]] StructuredBuffer<Vertex> vertices : register(t1);
[[vk::binding(2)]] StructuredBuffer<float4> normals : register(t2);
[[vk::binding(3)]] RWStructuredBuffer<Skinned> skinned : register(u0);
[[vk::binding(4)]] cbuffer Methods : register(b0) { int method; int second_method; uint count; int bulge_form; };

[numthreads(64, 1, 1)]
void skin(uint3 id : SV_DispatchThreadID) {
    if (id.x >= count) return;
    Vertex v = vertices[id.x];
    int bones[SINEW_INFLUENCES];
    float weights[SINEW_INFLUENCES];
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        bones[i] = int(v.bones[i]);
        weights[i] = v.weights[i];
    }
    float3 moved = sinew_mix(method, second_method, v.share, v.position, v.centre, bones, weights);
    float linear_share = sinew_linear_share(method, second_method, v.share);
    moved = sinew_twist_spread(moved, linear_share, v.twist, v.position, bones, weights);
    moved = sinew_bulge_limit(moved, bulge_form, v.bulge, v.position, bones, weights);
    skinned[id.x].position = float4(moved, 1.0);
    float3 normal = sinew_normal(method, normals[id.x].xyz, bones, weights);
    skinned[id.x].normal = float4(sinew_twist_normal(normal, v.twist, v.position, bones, weights), 0.0);
}
