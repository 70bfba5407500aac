#include "linalg/front_schedule.hpp"

#include <algorithm>

namespace qlb {
namespace {

class TwoStacks {
 public:
  TwoStacks(const Supernodes& supernodes, std::span<const std::int64_t> size, std::vector<std::int64_t>& offset)
      : size_(size), offset_(offset), odd_(supernodes.count(), 0) {
    for (std::int32_t s = supernodes.count() - 1; s >= 0; --s)
      if (supernodes.parent[s] >= 0) odd_[s] = !odd_[supernodes.parent[s]];
  }

  void push(std::int32_t s) {
    offset_[s] = used_[odd_[s]];
    used_[odd_[s]] += size_[s];
    peak_ = std::max(peak_, used_[0] + used_[1]);
    pushed_.push_back(s);
  }
  void pop(std::int32_t s) { used_[odd_[s]] -= size_[s]; }
  std::int64_t peak() const { return peak_; }
  // The odd stack counts down from the end of an area of `capacity`.
  void turn_odd(std::int64_t capacity) {
    for (const std::int32_t s : pushed_)
      if (odd_[s]) offset_[s] = capacity - offset_[s] - size_[s];
  }

 private:
  std::span<const std::int64_t> size_;
  std::vector<std::int64_t>& offset_;
  std::vector<std::uint8_t> odd_;
  std::vector<std::int32_t> pushed_;
  std::int64_t used_[2] = {0, 0}, peak_ = 0;
};

}  // namespace

Schedule make_schedule(const Supernodes& supernodes, std::span<const double> work, int threads, double pieces) {
  const std::int32_t count = supernodes.count();
  Schedule schedule;
  if (threads <= 1) {
    schedule.subtrees.push_back({0, count});
    return schedule;
  }
  std::vector<double> subtree(work.begin(), work.end());
  std::vector<std::int32_t> open;
  double total = 0.0;
  for (std::int32_t s = 0; s < count; ++s) {
    total += work[s];
    if (supernodes.parent[s] >= 0)
      subtree[supernodes.parent[s]] += subtree[s];
    else
      open.push_back(s);
  }
  const auto lighter = [&](std::int32_t a, std::int32_t b) { return subtree[a] < subtree[b]; };
  std::make_heap(open.begin(), open.end(), lighter);
  while (!open.empty() && subtree[open.front()] > total / (pieces * threads)) {
    std::pop_heap(open.begin(), open.end(), lighter);
    schedule.top.push_back(open.back());
    open.pop_back();
    for (const std::int32_t c : supernodes.children(schedule.top.back())) {
      open.push_back(c);
      std::push_heap(open.begin(), open.end(), lighter);
    }
  }
  std::sort(schedule.top.begin(), schedule.top.end());
  std::sort(open.begin(), open.end(), [&](std::int32_t a, std::int32_t b) { return subtree[a] > subtree[b]; });
  for (const std::int32_t s : open) schedule.subtrees.push_back({s - supernodes.descendants[s] + 1, s + 1});
  return schedule;
}

Placement place_blocks(const Supernodes& supernodes, const Schedule& schedule, std::span<const std::int64_t> size) {
  Placement placement;
  placement.offset.assign(supernodes.count(), 0);
  placement.shared.assign(supernodes.count(), 0);
  TwoStacks inner(supernodes, size, placement.offset), top(supernodes, size, placement.offset);
  std::int64_t roots = 0;
  for (const auto& [first, last] : schedule.subtrees)
    for (std::int32_t s = first; s < last; ++s) {
      if (s + 1 == last) {
        placement.shared[s] = 1;
        placement.offset[s] = roots;
        roots += size[s];
      } else {
        inner.push(s);
      }
      for (const std::int32_t c : supernodes.children(s)) inner.pop(c);
    }
  inner.turn_odd(placement.thread_size = inner.peak());
  for (const std::int32_t s : schedule.top) {
    placement.shared[s] = 1;
    top.push(s);
    for (const std::int32_t c : supernodes.children(s))
      if (std::binary_search(schedule.top.begin(), schedule.top.end(), c)) top.pop(c);
  }
  top.turn_odd(top.peak());
  for (const std::int32_t s : schedule.top) placement.offset[s] += roots;
  placement.shared_size = roots + top.peak();
  return placement;
}

}  // namespace qlb
