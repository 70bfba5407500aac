// Fill-reducing order of the free degrees of freedom.
#pragma once

#include <span>
#include <vector>

#include "assembly/block_pattern.hpp"

namespace qlb {

// Nested dissection (METIS) of the graph of nodes that have a free degree of freedom, each node then expanded
// to its own: several times less fill than ordering the degrees of freedom one by one. fixed: (nodes, 3),
// nonzero where held. Returns degrees of freedom (3 node + axis) in elimination order.
std::vector<std::int64_t> nested_dissection(const BlockPattern& pattern, std::span<const std::uint8_t> fixed);

}  // namespace qlb
