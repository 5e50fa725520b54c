// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sinew/base/targets.h"

namespace sinew {

/// Consecutive columns of a factor that are stored as if all of them had the same rows below (a supernode). One
/// row index serves all columns of a block, and the right side is read once for many columns.
struct FactorBlock {
    std::uint32_t first;      // the first column
    std::uint32_t width;      // number of columns
    std::uint32_t first_row;  // index into BlockFactor::rows
    std::uint32_t row_count;  // number of rows below the block, common to all its columns
    std::size_t first_value;  // index into BlockFactor::values
};

/// The factor L of a matrix L D L^T. L has unit diagonal.
struct BlockFactor {
    std::vector<FactorBlock> blocks;
    std::vector<std::int32_t> rows;
    // For each block, row by row: first the triangle (row k has k numbers), then `width` numbers for each row
    // below.
    std::vector<double> values;
    std::vector<double> diagonal;  // the diagonal of D

    [[nodiscard]] static constexpr std::size_t triangle(std::size_t width) { return width * (width - 1) / 2; }
};

/// Right sides are solved in groups of this many. The first of a group is not negative, and shows where the group
/// is 0.
inline constexpr std::size_t kGroupColumns = 10;

/// The number of groups that are solved together; they fill five of the widest vectors.
inline constexpr std::size_t kGroups = 4;

/// The number of right sides in one row.
inline constexpr std::size_t kSolvedColumns = kGroups * kGroupColumns;

/// Solves for right sides in place. Results may differ by rounding between instruction sets.
///
/// nothing     a group whose first number is smaller than this is set to 0
/// x           [columns][kSolvedColumns] right sides, then solutions
/// is_nonzero  [columns] 0 where the whole row of x is 0, else 1
using SolveBlocks = void(const BlockFactor& factor, double nothing, double* x, std::uint8_t* is_nonzero);

/// For each instruction set.
extern const OfTargets<SolveBlocks> kSolveBlocks;

}  // namespace sinew
