// SPDX-License-Identifier: MIT
// The normal of each vertex in the world, and the value of a measure (docs/metrics.md).

struct Uniforms {
    @align(16) world_from_armature: mat4x4f,
}
@group(0) @binding(0) var<uniform> uniforms: Uniforms;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> reference: array<vec4f>;
@group(0) @binding(3) var<storage, read> rest: array<vec4f>;
@group(0) @binding(4) var<storage, read> around: array<vec4u>;   // first and number of corners, then of edges
@group(0) @binding(5) var<storage, read> corners: array<vec2u>;  // the other two vertices of each triangle
@group(0) @binding(6) var<storage, read> ends: array<u32>;       // the other end of each edge
@group(0) @binding(7) var<storage, read_write> result: array<vec4f>;

fn in_world(v: vec4f) -> vec3f {
    return (uniforms.world_from_armature * vec4f(v.xyz, 0.0)).xyz;
}

@compute @workgroup_size(64)
fn surface(@builtin(global_invocation_id) id: vec3u) {
    let vertex = id.x;
    if vertex >= arrayLength(&result) { return; }
    let own = points[vertex];
    let span = around[vertex];
    var normal = vec3f(0.0);
    for (var k = span.x; k < span.x + span.y; k++) {
        normal += cross(in_world(points[corners[k].x] - own), in_world(points[corners[k].y] - own));
    }
    var value = length(in_world(own - reference[vertex])) * f32(MEASURE == 1u);
    if MEASURE == 2u {
        var worst = 0.0;
        for (var k = span.z; k < span.z + span.w; k++) {
            let end = ends[k];
            let before = length(in_world(rest[end] - rest[vertex]));
            let now = length(in_world(points[end] - own));
            let stretch = select(0.0, log(max(now / before, 1e-12)), before > 0.0);
            if abs(stretch) > abs(worst) { worst = stretch; }
        }
        value = exp(worst);
    }
    result[vertex] = vec4f(normal / max(length(normal), 1e-30), value);
}
