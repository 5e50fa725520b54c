#version 300 es
// SPDX-License-Identifier: MIT
precision highp float;

uniform vec3 line;

in float share;
out vec4 colour;

void main() {
    colour = 0.3 * share * vec4(line, 1.0);
}
