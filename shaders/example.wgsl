// SPDX-License-Identifier: MIT
// A compute shader; the text of sinew.wgsl comes before this.

struct Vertex {
    position: vec3f,
    share: f32,  // of the second method, painted
    centre: vec3f,
    twist: f32,  // how much Twist Spread moves the vertex
    bulge: f32,  // the same for Limit Bulge
    bones: array<vec4u, SINEW_INFLUENCES / 4u>,
    weights: array<vec4f, SINEW_INFLUENCES / 4u>,
}
struct Skinned {
    position: vec3f,
    normal: vec3f,
}
struct Methods {
    first: u32,
    second: u32,
    count: u32,
    bulge_form: u32,
}
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> normals: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> skinned: array<Skinned>;
@group(0) @binding(4) var<uniform> methods: Methods;

@compute @workgroup_size(64)
fn skin(@builtin(global_invocation_id) id: vec3u) {
    let index = id.x;
    if index >= methods.count { return; }
    var own: SinewInfluences;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        own.bones[i] = vertices[index].bones[i / 4u][i % 4u];
        own.weights[i] = vertices[index].weights[i / 4u][i % 4u];
    }
    let x = vertices[index].position;
    let share = vertices[index].share;
    let twist = vertices[index].twist;
    var moved = sinew_mix(methods.first, methods.second, share, x, vertices[index].centre, own);
    moved = sinew_twist_spread(moved, sinew_linear_share(methods.first, methods.second, share), twist, x, own);
    skinned[index].position = sinew_bulge_limit(moved, methods.bulge_form, vertices[index].bulge, x, own);
    let normal = sinew_normal(methods.first, normals[index].xyz, own);
    skinned[index].normal = sinew_twist_normal(normal, twist, x, own);
}
