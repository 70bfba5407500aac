// Which thread works on which supernodes, and where in memory pending results of their fronts stand.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linalg/supernodes.hpp"

namespace qlb {

// Independent subtrees, the largest first, each for one thread; then what lies above them, in order, each for all
// threads together. What is computed for a supernode does not depend on this, only who computes it.
struct Schedule {
  struct Range {
    std::int32_t first, last;  // supernodes first to last - 1
  };
  std::vector<Range> subtrees;
  std::vector<std::int32_t> top;
};

// Subtrees are split until the largest is `pieces` times smaller than a thread's share of the work.
Schedule make_schedule(const Supernodes& supernodes, std::span<const double> work, int threads, double pieces);

// Room for one pending block per supernode, from when it is made until its parent has taken it.
//
// Along a postorder these form two stacks, one for even depths of the tree and one for odd: a supernode puts its own
// block on one while those of its children, the latest on the other, are still there. The two grow towards each other.
struct Placement {
  std::vector<std::int64_t> offset;  // in the area of the thread, or in the shared one
  std::vector<std::uint8_t> shared;  // nonzero for roots of subtrees and all above
  std::int64_t thread_size = 0, shared_size = 0;
};

Placement place_blocks(const Supernodes& supernodes, const Schedule& schedule, std::span<const std::int64_t> size);

}  // namespace qlb
