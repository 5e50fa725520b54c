#version 300 es
// SPDX-License-Identifier: MIT
// A grid on the ground, in lines that fade out.
precision highp float;

uniform vec3 middle;
uniform float radius;
uniform float spacing;
uniform mat4 clip_from_world;

out float share;

void main() {
    int piece = gl_VertexID >> 1;
    int line = piece / PIECES;
    float across = float(line % LINES - LINES / 2) * spacing;
    float along = (2.0 * float(piece % PIECES + (gl_VertexID & 1)) / float(PIECES) - 1.0) * radius;
    vec2 place = line < LINES ? vec2(across, along) : vec2(along, across);
    share = 1.0 - smoothstep(0.1, 1.0, length(place) / radius);
    vec2 start = floor(middle.xy / spacing + 0.5) * spacing;
    gl_Position = clip_from_world * vec4(start + place, middle.z, 1.0);
}
