#version 300 es
// SPDX-License-Identifier: MIT
// The normal of each vertex in the world, and the value of a measure (docs/metrics.md): a texel each.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

uniform sampler2D points;
uniform sampler2D reference;
uniform sampler2D rest;
uniform usampler2D around;   // of each vertex: first and number of its corners, then of its edges
uniform usampler2D corners;  // the other two vertices of each triangle
uniform usampler2D ends;     // the other end of each edge
uniform mat4 world_from_armature;

out vec4 surface;

ivec2 place_of(int k) {
    return ivec2(k & (WIDTH - 1), k >> SHIFT);
}

vec3 to(sampler2D shape, uint vertex, vec3 from) {
    return mat3(world_from_armature) * (texelFetch(shape, place_of(int(vertex)), 0).xyz - from);
}

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    vec3 own = texelFetch(points, place, 0).xyz;
    vec3 at_rest = texelFetch(rest, place, 0).xyz;
    uvec4 span = texelFetch(around, place, 0);
    vec3 normal = vec3(0.0);
    for (uint k = 0u; k < span.y; ++k) {
        uvec2 others = texelFetch(corners, place_of(int(span.x + k)), 0).xy;
        normal += cross(to(points, others.x, own), to(points, others.y, own));
    }
    float value = 0.0;
    if (MEASURE == 1) value = length(mat3(world_from_armature) * (own - texelFetch(reference, place, 0).xyz));
    if (MEASURE == 2) {
        float worst = 0.0;
        for (uint k = 0u; k < span.w; ++k) {
            uint end = texelFetch(ends, place_of(int(span.z + k)), 0).x;
            float before = length(to(rest, end, at_rest));
            float stretch = before > 0.0 ? log(max(length(to(points, end, own)) / before, 1e-12)) : 0.0;
            if (abs(stretch) > abs(worst)) worst = stretch;
        }
        value = exp(worst);
    }
    surface = vec4(normal / max(length(normal), 1e-30), value);
}
