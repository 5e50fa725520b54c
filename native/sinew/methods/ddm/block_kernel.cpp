// SPDX-License-Identifier: GPL-3.0-or-later
// Solves with a BlockFactor on lanes.
#include <algorithm>

#include "sinew/lanes/kernel.h"
#include "sinew/methods/ddm/block_factor.h"

#define SINEW_THIS_FILE "sinew/methods/ddm/block_kernel.cpp"
#include "sinew/lanes/all_targets.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// A row of right sides is processed in groups of this many vectors, so that as many sums are in progress at once.
constexpr std::size_t kVectors = 5;
using Doubles = hn::CappedTag<double, kSolvedColumns / kVectors>;
using DoubleVec = hn::Vec<Doubles>;
constexpr std::size_t kPanel = kVectors * hn::MaxLanes(Doubles());

/// kVectors vectors of one row.
struct Row {
    DoubleVec part[kVectors];
};

HWY_INLINE Row load(const double* x) {
    const Doubles d;
    Row row;
    for (std::size_t v = 0; v < kVectors; ++v) row.part[v] = hn::LoadU(d, x + v * hn::Lanes(d));
    return row;
}

HWY_INLINE void store(const Row& row, double* x) {
    const Doubles d;
    for (std::size_t v = 0; v < kVectors; ++v) hn::StoreU(row.part[v], d, x + v * hn::Lanes(d));
}

HWY_INLINE void subtract(double factor, const Row& from, Row& row) {
    const DoubleVec scale = hn::Set(Doubles(), factor);
    for (std::size_t v = 0; v < kVectors; ++v) {
        row.part[v] = hn::NegMulAdd(scale, from.part[v], row.part[v]);
    }
}

/// Clears each group whose first number is less than `least`. Returns whether any group is not 0.
HWY_INLINE bool clear_small(double least, double* x) {
    bool any_nonzero = false;
    for (std::size_t group = 0; group < kGroups; ++group) {
        double* const numbers = x + kGroupColumns * group;
        if (numbers[0] >= least) {
            any_nonzero = true;
        } else {
            std::fill_n(numbers, kGroupColumns, 0.0);
        }
    }
    return any_nonzero;
}

/// A block and its right sides.
struct Part {
    const FactorBlock& block;
    const double* triangle;
    const double* below;
    const std::int32_t* rows;
    double* all;
    double* own;  // of its own columns
    std::uint8_t* is_nonzero;
    std::uint8_t* own_is_nonzero;
};

HWY_INLINE Part part_of(const BlockFactor& factor, const FactorBlock& block, double* x,
                        std::uint8_t* is_nonzero) {
    const double* const triangle = factor.values.data() + block.first_value;
    return {block,
            triangle,
            triangle + BlockFactor::triangle(block.width),
            factor.rows.data() + block.first_row,
            x,
            x + kSolvedColumns * block.first,
            is_nonzero,
            is_nonzero + block.first};
}

HWY_INLINE bool is_any(const std::uint8_t* is_nonzero, std::size_t count) {
    return std::find(is_nonzero, is_nonzero + count, std::uint8_t{1}) != is_nonzero + count;
}

/// Solves with the triangle. Returns whether any right side is not 0.
HWY_INLINE bool solve_forward(const Part& part, const double* diagonal, double nothing) {
    bool any_nonzero = false;
    for (std::size_t k = 0; k < part.block.width; ++k) {
        double* const x = part.own + kSolvedColumns * k;
        const double* const values = part.triangle + BlockFactor::triangle(k);
        for (std::size_t at = 0; k > 0 && at < kSolvedColumns; at += kPanel) {
            Row row = load(x + at);
            for (std::size_t i = 0; i < k; ++i) {
                subtract(values[i], load(part.own + kSolvedColumns * i + at), row);
            }
            store(row, x + at);
        }
        part.own_is_nonzero[k] = clear_small(nothing * diagonal[k], x) ? 1 : 0;
        any_nonzero = any_nonzero || part.own_is_nonzero[k] != 0;
    }
    return any_nonzero;
}

/// Subtracts the contribution of the block's columns from the rows below.
HWY_INLINE void spread(const Part& part) {
    const std::size_t width = part.block.width;
    const std::size_t count = part.block.row_count;
    std::size_t i = 0;
    for (; i + 2 <= count; i += 2) {
        const double* const values = part.below + width * i;
        double* const a = part.all + kSolvedColumns * static_cast<std::size_t>(part.rows[i]);
        double* const b = part.all + kSolvedColumns * static_cast<std::size_t>(part.rows[i + 1]);
        for (std::size_t at = 0; at < kSolvedColumns; at += kPanel) {
            Row row_a = load(a + at);
            Row row_b = load(b + at);
            for (std::size_t k = 0; k < width; ++k) {
                const Row from = load(part.own + kSolvedColumns * k + at);
                subtract(values[k], from, row_a);
                subtract(values[width + k], from, row_b);
            }
            store(row_a, a + at);
            store(row_b, b + at);
        }
    }
    if (i < count) {
        double* const a = part.all + kSolvedColumns * static_cast<std::size_t>(part.rows[i]);
        for (std::size_t at = 0; at < kSolvedColumns; at += kPanel) {
            Row row = load(a + at);
            for (std::size_t k = 0; k < width; ++k) {
                subtract(part.below[width * i + k], load(part.own + kSolvedColumns * k + at), row);
            }
            store(row, a + at);
        }
    }
    for (i = 0; i < count; ++i) part.is_nonzero[part.rows[i]] = 1;
}

/// Subtracts the contribution of the rows below from columns [k, k + kColumns).
template <std::size_t kColumns>
HWY_INLINE void collect(const Part& part, std::size_t k) {
    const std::size_t width = part.block.width;
    for (std::size_t at = 0; at < kSolvedColumns; at += kPanel) {
        Row sums[kColumns];
        for (std::size_t c = 0; c < kColumns; ++c) sums[c] = load(part.own + kSolvedColumns * (k + c) + at);
        const double* values = part.below + k;
        for (std::size_t i = 0; i < part.block.row_count; ++i, values += width) {
            const Row from = load(part.all + kSolvedColumns * static_cast<std::size_t>(part.rows[i]) + at);
            for (std::size_t c = 0; c < kColumns; ++c) subtract(values[c], from, sums[c]);
        }
        for (std::size_t c = 0; c < kColumns; ++c) store(sums[c], part.own + kSolvedColumns * (k + c) + at);
    }
}

/// Solves with the transposed triangle.
HWY_INLINE void solve_backward(const Part& part, double nothing) {
    const std::size_t width = part.block.width;
    for (std::size_t k = width; k-- > 0;) {
        double* const x = part.own + kSolvedColumns * k;
        for (std::size_t at = 0; k + 1 < width && at < kSolvedColumns; at += kPanel) {
            Row row = load(x + at);
            for (std::size_t i = k + 1; i < width; ++i) {
                subtract(part.triangle[BlockFactor::triangle(i) + k],
                         load(part.own + kSolvedColumns * i + at), row);
            }
            store(row, x + at);
        }
        part.own_is_nonzero[k] = clear_small(nothing, x) ? 1 : 0;
    }
}

void divide(const double* diagonal, std::size_t width, double* x) {
    for (std::size_t k = 0; k < width; ++k, x += kSolvedColumns) {
        const double inverse = 1.0 / diagonal[k];
        for (std::size_t column = 0; column < kSolvedColumns; ++column) x[column] *= inverse;
    }
}

}  // namespace

void solve(const BlockFactor& factor, double nothing, double* x, std::uint8_t* is_nonzero) {
    for (const FactorBlock& block : factor.blocks) {
        const Part part = part_of(factor, block, x, is_nonzero);
        if (!is_any(part.own_is_nonzero, block.width)) continue;
        if (solve_forward(part, factor.diagonal.data() + block.first, nothing)) spread(part);
    }
    for (std::size_t b = factor.blocks.size(); b-- > 0;) {
        const FactorBlock& block = factor.blocks[b];
        const Part part = part_of(factor, block, x, is_nonzero);
        bool is_needed = is_any(part.own_is_nonzero, block.width);
        for (std::size_t i = 0; i < block.row_count && !is_needed; ++i) {
            is_needed = is_nonzero[part.rows[i]] != 0;
        }
        if (!is_needed) continue;
        divide(factor.diagonal.data() + block.first, block.width, part.own);
        std::size_t k = 0;
        for (; k + 2 <= block.width; k += 2) collect<2>(part, k);
        if (k < block.width) collect<1>(part, k);
        solve_backward(part, nothing);
    }
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
constinit const OfTargets<SolveBlocks> kSolveBlocks SINEW_TARGETS(solve);

}  // namespace sinew

#endif
