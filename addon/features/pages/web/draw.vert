#version 300 es
// SPDX-License-Identifier: MIT
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D points;
uniform sampler2D surface;
uniform mat4 world_from_armature;
uniform mat4 clip_from_world;

out vec3 position;
out vec3 normal;
out float value;

void main() {
    ivec2 place = ivec2(gl_VertexID & (WIDTH - 1), gl_VertexID >> SHIFT);
    vec4 own = texelFetch(surface, place, 0);
    vec4 world = world_from_armature * vec4(texelFetch(points, place, 0).xyz, 1.0);
    position = world.xyz;
    normal = own.xyz;
    value = own.w;
    gl_Position = clip_from_world * world;
}
