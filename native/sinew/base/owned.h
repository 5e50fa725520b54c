// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <utility>

namespace sinew {

/// Owns what only a .cpp file defines. A class with such a member needs no destructor and no moves of its own.
template <class State>
using Owned = std::unique_ptr<State, void (*)(State*)>;

template <class State, class... Arguments>
[[nodiscard]] Owned<State> make_owned(Arguments&&... arguments) {
    return {new State(std::forward<Arguments>(arguments)...), [](State* state) { delete state; }};
}

}  // namespace sinew
