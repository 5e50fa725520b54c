#version 300 es
// SPDX-License-Identifier: MIT
// The point of each vertex, in armature space: a texel each.
precision highp float;
precision highp int;
precision highp sampler2D;

#include "sinew.glsl"

uniform sampler2D rest;        // position, and the share of the second method
uniform sampler2D centres;
uniform sampler2D amounts;     // of Twist Spread and Limit Bulge
uniform sampler2D offsets;     // of a recorded shape
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
    vec3 x = at_rest.xyz;
    vec3 centre = texelFetch(centres, place, 0).xyz;
    vec3 moved = sinew_mix(METHOD, SECOND_METHOD, at_rest.w, x, centre, bones, weights);
#if STAGES
    vec2 amount = texelFetch(amounts, place, 0).xy;
    float linear_share = sinew_linear_share(METHOD, SECOND_METHOD, at_rest.w);
    moved = sinew_twist_spread(moved, linear_share, amount.x, x, bones, weights);
    moved = sinew_bulge_limit(moved, BULGE_FORM, amount.y, x, bones, weights);
#endif
#if RECORDED
    moved += texelFetch(offsets, place, 0).xyz;
#endif
    point = vec4(moved, 1.0);
}
