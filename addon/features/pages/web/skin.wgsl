// SPDX-License-Identifier: MIT
// The point of each vertex, in armature space.

#include "sinew.wgsl"

@group(0) @binding(1) var<storage, read> rest: array<vec4f>;     // position, and the share of the second method
@group(0) @binding(2) var<storage, read> centres: array<vec4f>;
@group(0) @binding(3) var<storage, read> amounts: array<vec2f>;  // of Twist Spread and Limit Bulge
@group(0) @binding(4) var<storage, read> influences: array<vec2f>;  // bone and weight, SINEW_INFLUENCES for each vertex
@group(0) @binding(5) var<storage, read> offsets: array<vec4f>;  // of a recorded shape
@group(0) @binding(6) var<storage, read_write> result: array<vec4f>;

@compute @workgroup_size(64)
fn skin(@builtin(global_invocation_id) id: vec3u) {
    let vertex = id.x;
    if vertex >= arrayLength(&result) { return; }
    var own: SinewInfluences;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        let influence = influences[vertex * SINEW_INFLUENCES + i];
        own.bones[i] = u32(influence.x);
        own.weights[i] = influence.y;
    }
    let x = rest[vertex].xyz;
    let share = rest[vertex].w;
    let amount = amounts[vertex];
    var moved = sinew_mix(METHOD, SECOND_METHOD, share, x, centres[vertex].xyz, own);
    if STAGES == 1u {
        moved = sinew_twist_spread(moved, sinew_linear_share(METHOD, SECOND_METHOD, share), amount.x, x, own);
        moved = sinew_bulge_limit(moved, BULGE_FORM, amount.y, x, own);
    }
    if RECORDED == 1u { moved += offsets[vertex].xyz; }
    result[vertex] = vec4f(moved, 1.0);
}
