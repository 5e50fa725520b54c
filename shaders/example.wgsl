// SPDX-License-Identifier: MIT
// A compute shader; the text of sinew.wgsl comes before this.

struct Vertex {
    position: vec3f,
    share: f32,  // of the second method, painted
    centre: vec3f,
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
}
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> normals: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> skinned: array<Skinned>;
@group(0) @binding(4) var<uniform> methods: Methods;

@compute @workgroup_size(64)
fn skin(@builtin(global_invocation_id) id: vec3u) {
    let index = id.x;
    if index >= arrayLength(&vertices) { return; }
    var own: SinewInfluences;
    for (var i = 0u; i < SINEW_INFLUENCES; i++) {
        own.bones[i] = vertices[index].bones[i / 4u][i % 4u];
        own.weights[i] = vertices[index].weights[i / 4u][i % 4u];
    }
    let x = vertices[index].position;
    let centre = vertices[index].centre;
    skinned[index].position = sinew_mix(methods.first, methods.second, vertices[index].share, x, centre, own);
    skinned[index].normal = sinew_normal(normals[index].xyz, own);
}
