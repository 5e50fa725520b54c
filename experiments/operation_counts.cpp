// SPDX-License-Identifier: GPL-3.0-or-later
// Prints the counted operations as JSON: {table: {name: {operation: count}}}.
#include "experiments/operation_counts.h"

#include <cstdio>

int main() {
    std::string_view table;
    for (const experiments::OperationCount& count : experiments::operation_counts()) {
        const experiments::Operations& o = count.operations;
        const bool is_first = count.table != table;
        if (is_first) std::printf("%s\"%s\": {\n", table.empty() ? "{" : "\n},\n", count.table.data());
        table = count.table;
        std::printf(
            "%s \"%s\": {\"additions\": %d, \"multiplications\": %d, \"doublings\": %d, "
            "\"divisions\": %d, \"roots\": %d, \"functions\": %d, \"comparisons\": %d, "
            "\"negations\": %d, \"total\": %d}",
            is_first ? "" : ",\n", count.name.data(), o.additions, o.multiplications, o.doublings,
            o.divisions, o.roots, o.functions, o.comparisons, o.negations, o.total());
    }
    std::printf("\n}}\n");
}
