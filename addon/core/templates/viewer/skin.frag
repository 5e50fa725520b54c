#version 300 es
// SPDX-License-Identifier: MIT
// The point of each vertex, in armature space: a texel each.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "sinew.glsl"

uniform int method;
uniform int second_method;
uniform sampler2D rest;        // position, and the share of the second method
uniform sampler2D centres;
uniform sampler2D influences;  // bone and weight, SINEW_INFLUENCES for each vertex

out vec4 point;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    int first = (place.y * WIDTH + place.x) * SINEW_INFLUENCES;
    int bones[SINEW_INFLUENCES];
    float weights[SINEW_INFLUENCES];
    for (int i = 0; i < SINEW_INFLUENCES; ++i) {
        int k = first + i;
        vec2 influence = texelFetch(influences, ivec2(k & (WIDTH - 1), k >> SHIFT), 0).xy;
        bones[i] = int(influence.x);
        weights[i] = influence.y;
    }
    vec4 at_rest = texelFetch(rest, place, 0);
    vec3 centre = texelFetch(centres, place, 0).xyz;
    point = vec4(sinew_mix(method, second_method, at_rest.w, at_rest.xyz, centre, bones, weights), 1.0);
}
