// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/kernels.h"

#include <vector>

#include "sinew/deform/thread_pool.h"
#include "sinew/skinning/dq.h"
#include "sinew/skinning/lbs.h"
#include "sinew/skinning/qv.h"

namespace sinew {
namespace {

bool is_identity(const Affine<float>& a) {
    return a.linear == Mat3<float>(1.0f) && a.translation == Vec3<float>(0.0f);
}

template <class Method>
void deform_with(const MeshView& mesh, std::span<const Affine<float>> posed_from_rest,
                 std::span<const Affine<float>> rest_bones, const Affine<float>& bones_from_model,
                 std::size_t threads, std::span<Vec3<float>> points) {
    // Per bone in double: a few hundred of them, against the rounding of every vertex.
    using Bone = typename Method::template Bone<float>;
    std::vector<Bone> bones(posed_from_rest.size());
    for (std::size_t bone = 0; bone < bones.size(); ++bone) {
        bones[bone] =
            cast<float>(Method::prepare(cast<double>(posed_from_rest[bone]), cast<double>(rest_bones[bone])));
    }
    const std::span<const Bone> palette(bones);
    const bool same_space = is_identity(bones_from_model);
    const Affine<float> model_from_bones = cast<float>(inverse(cast<double>(bones_from_model)));
    parallel_for(points.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t vertex = begin; vertex < end; ++vertex) {
            const Vec3<float>& rest = mesh.rest_points[vertex];
            const auto influences = mesh.influences.subspan(mesh.offsets[vertex],
                                                            mesh.offsets[vertex + 1] - mesh.offsets[vertex]);
            if (influences.empty()) {
                points[vertex] = rest;
            } else if (same_space) {
                points[vertex] = Method::template deform_vertex<float>(palette, influences, rest);
            } else {
                points[vertex] = transform_point(
                    model_from_bones, Method::template deform_vertex<float>(
                                          palette, influences, transform_point(bones_from_model, rest)));
            }
        }
    });
}

}  // namespace

void deform_mesh(MethodId method, const MeshView& mesh, std::span<const Affine<float>> posed_from_rest,
                 std::span<const Affine<float>> rest_bones, const Affine<float>& bones_from_model,
                 std::size_t threads, std::span<Vec3<float>> points) {
    const auto deform = [&]<class Method>() {
        deform_with<Method>(mesh, posed_from_rest, rest_bones, bones_from_model, threads, points);
    };
    switch (method) {
        case MethodId::lbs: return deform.operator()<Lbs>();
        case MethodId::qv: return deform.operator()<Qv>();
        case MethodId::dq: return deform.operator()<Dq>();
    }
}

}  // namespace sinew
