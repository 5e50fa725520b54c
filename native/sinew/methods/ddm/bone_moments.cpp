// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/methods/ddm/bone_moments.h"

#include <algorithm>
#include <array>

namespace sinew {
namespace {

// A block with one common list of bones computes all of them for each vertex. If the list is more than this many
// times as long as those of its vertices, each lane gets its own list.
constexpr std::size_t kMaxShared = 2;

using Row = std::array<float, kMomentNumbers>;

/// The moments of one bone at one vertex.
struct BoneRow {
    std::int32_t bone;
    Row numbers;
};

/// The bone of a row [kMomentFloats].
std::int32_t bone_of(const float* row) { return static_cast<std::int32_t>(row[1]); }

/// Whether all numbers of the row are 0.
bool is_empty(const float* row) {
    return std::all_of(row + 2, row + kMomentFloats, [](float number) { return number == 0.0f; });
}

/// The rows of each vertex.
class RowsByVertex {
public:
    RowsByVertex(const PackedMesh& mesh, std::span<const float> rows) : mesh_(mesh), rows_(rows) {}

    /// The rows of the vertex in lane `lane` of block `b`.
    void find(std::size_t b, std::size_t lane, std::vector<BoneRow>& found) const {
        found.clear();
        const auto vertex = static_cast<std::size_t>(mesh_.vertices[b].lane[lane]);
        for (std::size_t row = first_of(vertex); row < count() && vertex_of(row) == vertex; ++row) {
            if (is_empty(at(row))) continue;
            const auto used = std::ranges::lower_bound(mesh_.used_bones, bone_of(at(row)));
            found.push_back({static_cast<std::int32_t>(used - mesh_.used_bones.begin()), {}});
            std::copy_n(at(row) + 2, kMomentNumbers, found.back().numbers.begin());
        }
        double sum = 0.0;
        for (const BoneRow& row : found) sum += static_cast<double>(row.numbers[0]);
        if (!(sum > 0.0)) add_point(b, lane, found);
    }

private:
    [[nodiscard]] std::size_t count() const { return rows_.size() / kMomentFloats; }
    [[nodiscard]] const float* at(std::size_t row) const { return &rows_[kMomentFloats * row]; }
    [[nodiscard]] std::size_t vertex_of(std::size_t row) const { return static_cast<std::size_t>(*at(row)); }

    [[nodiscard]] std::size_t first_of(std::size_t vertex) const {
        std::size_t begin = 0;
        std::size_t end = count();
        while (begin < end) {
            const std::size_t middle = begin + (end - begin) / 2;
            vertex_of(middle) < vertex ? begin = middle + 1 : end = middle;
        }
        return begin;
    }

    /// The vertex's rest point as its neighbourhood, with the weights of its influences.
    void add_point(std::size_t b, std::size_t lane, std::vector<BoneRow>& found) const {
        found.clear();
        const Lanes<float>* const xyz = &mesh_.rest_points[kPointRows * b];
        for (std::size_t k = 0; k < mesh_.blocks[b].influences; ++k) {
            const auto [bone, weight] = influence_at(mesh_, b, lane, k);
            if (weight == 0.0f) continue;
            const Row row{weight, weight * xyz[0].lane[lane], weight * xyz[1].lane[lane],
                          weight * xyz[2].lane[lane]};
            const auto same = std::ranges::find(found, bone, &BoneRow::bone);
            if (same == found.end()) {
                found.push_back({bone, row});
            } else {
                for (std::size_t i = 0; i < 4; ++i) same->numbers[i] += row[i];
            }
        }
        std::ranges::sort(found, {}, &BoneRow::bone);
    }

    const PackedMesh& mesh_;
    std::span<const float> rows_;
};

class MomentPacker {
public:
    MomentPacker(const PackedMesh& mesh, std::span<const float> rows) : mesh_(mesh), by_vertex_(mesh, rows) {}

    std::unique_ptr<const PackedVertexData> run() {
        for (std::size_t b = 0; b < mesh_.blocks.size(); ++b) {
            if (mesh_.blocks[b].influences == 0) {
                moments_.blocks.push_back({{}, 0, 0, false});
            } else {
                add_block(b);
            }
        }
        return std::move(packed_);
    }

private:
    void add_block(std::size_t b) {
        std::vector<std::int32_t> bones;
        std::size_t most = 0;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            by_vertex_.find(b, lane, lanes_[lane]);
            most = std::max(most, lanes_[lane].size());
            for (const BoneRow& row : lanes_[lane]) bones.push_back(row.bone);
        }
        std::ranges::sort(bones);
        bones.erase(std::unique(bones.begin(), bones.end()), bones.end());
        MomentBlock block{{}, 0, static_cast<std::uint32_t>(bones.size()), bones.size() > kMaxShared * most};
        if (block.own_bones) {
            block.bones = static_cast<std::uint32_t>(most);
            bones = own_bones(most);
        }
        block.first_bone = place_of(bones, block);
        const auto counts = moment_rows(block.bones);
        for (std::size_t part = 0; part < kMomentParts; ++part) {
            std::vector<Lanes<float>>& rows = moments_.parts[part];
            block.first_rows[part] = static_cast<std::uint32_t>(rows.size());
            rows.resize(rows.size() + counts[part]);
        }
        for (std::size_t lane = 0; lane < kLanes; ++lane) fill(block, bones, lane);
        moments_.blocks.push_back(block);
    }

    /// [kLanes][most] bones; shorter lists repeat their last bone.
    [[nodiscard]] std::vector<std::int32_t> own_bones(std::size_t most) const {
        std::vector<std::int32_t> bones;
        for (const std::vector<BoneRow>& of_lane : lanes_) {
            for (std::size_t k = 0; k < most; ++k) {
                bones.push_back(of_lane[std::min(k, of_lane.size() - 1)].bone);
            }
        }
        return bones;
    }

    std::uint32_t place_of(const std::vector<std::int32_t>& bones, const MomentBlock& block) {
        if (!block.own_bones && !moments_.blocks.empty()) {
            const MomentBlock& before = moments_.blocks.back();
            const std::span known(moments_.bones);
            if (!before.own_bones && before.bones == block.bones &&
                std::ranges::equal(known.subspan(before.first_bone, before.bones), bones)) {
                return before.first_bone;
            }
        }
        const auto position = static_cast<std::uint32_t>(moments_.bones.size());
        moments_.bones.insert(moments_.bones.end(), bones.begin(), bones.end());
        return position;
    }

    [[nodiscard]] float& number_at(const MomentBlock& block, const MomentPosition& position,
                                   std::size_t lane) {
        return moments_.parts[static_cast<std::size_t>(position.part)][row_of(block, position)].lane[lane];
    }

    void fill(const MomentBlock& block, std::span<const std::int32_t> bones, std::size_t lane) {
        std::array<double, kMomentNumbers> sums{};
        for (std::size_t i = 0; i < lanes_[lane].size(); ++i) {
            const BoneRow& row = lanes_[lane][i];
            const std::size_t k =
                block.own_bones
                    ? i
                    : static_cast<std::size_t>(std::ranges::lower_bound(bones, row.bone) - bones.begin());
            for (std::size_t n = 0; n < kMomentNumbers; ++n) {
                number_at(block, moment_position(k, n), lane) = row.numbers[n];
                sums[n] += static_cast<double>(row.numbers[n]);
            }
        }
        for (std::size_t n = 1; n < kMomentNumbers; ++n) {
            const MomentPosition of_all =
                n < 4 ? MomentPosition{MomentPart::weight, n - 1} : MomentPosition{MomentPart::second, n - 4};
            number_at(block, of_all, lane) = static_cast<float>(sums[n]);
        }
    }

    const PackedMesh& mesh_;
    RowsByVertex by_vertex_;
    std::unique_ptr<BoneMoments> packed_ = std::make_unique<BoneMoments>();
    BoneMoments& moments_ = *packed_;
    std::array<std::vector<BoneRow>, kLanes> lanes_;
};

}  // namespace

std::unique_ptr<const PackedVertexData> pack_moments(const PackedMesh& mesh, std::span<const float> rows) {
    return MomentPacker(mesh, rows).run();
}

std::vector<float> BoneMoments::unpack(const PackedMesh& mesh, std::size_t) const {
    using Full = std::array<float, kMomentFloats>;
    std::vector<Full> found;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        const MomentBlock& block = blocks[b];
        for (std::size_t lane = 0; lane < mesh.blocks[b].vertices; ++lane) {
            for (std::size_t k = 0; k < block.bones; ++k) {
                const std::size_t bone = block.first_bone + (block.own_bones ? lane * block.bones : 0) + k;
                Full row{static_cast<float>(mesh.vertices[b].lane[lane]),
                         static_cast<float>(mesh.used_bones[static_cast<std::size_t>(bones[bone])])};
                for (std::size_t n = 0; n < kMomentNumbers; ++n) {
                    const MomentPosition position = moment_position(k, n);
                    const auto part = static_cast<std::size_t>(position.part);
                    row[2 + n] = parts[part][row_of(block, position)].lane[lane];
                }
                if (!is_empty(row.data())) found.push_back(row);
            }
        }
    }
    std::ranges::sort(found,
                      [](const Full& a, const Full& b) { return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1]; });
    std::vector<float> values;
    values.reserve(kMomentFloats * found.size());
    for (const Full& row : found) values.insert(values.end(), row.begin(), row.end());
    return values;
}

}  // namespace sinew
