#include "linalg/supernodal_factor.hpp"

#include <omp.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "linalg/compact_layout.hpp"
#include "linalg/teamwork.hpp"
#include "simd/flush_subnormals.hpp"

namespace qlb {
namespace {

constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kSmallPanel = 24 * 1024;  // entries; a larger panel is cut up for the cache and for threads
constexpr double kThreadedFlops = 5e7, kThreadedEntries = 5e5;  // less in all is not worth a second thread
constexpr double kThreadedCompact = 2e7;  // of the compact copy, which one core reads as fast as two while it is small
constexpr double kSharedFlops = 4e6;      // a front of fewer operations is not worth the team's waiting
constexpr std::int64_t kColumnsPerTask = 32;  // of a matrix that is cleared or added up by a team

std::int64_t rounded(std::int64_t n) {
  return (n + kPadding - 1) / kPadding * kPadding;
}
std::int64_t pieces(std::int64_t n, std::int64_t size) {
  return (n + size - 1) / size;
}

// What the first columns of a panel take in the compact copy: whole wide blocks, or all columns.
std::int64_t compact_panel_bytes(std::int64_t front, std::int64_t columns) {
  std::int64_t sum = 0;
  for (std::int64_t j = 0; j < columns; j += kWide)
    sum += CompactLayout{front, j, std::min<std::int64_t>(columns, j + kWide)}.bytes();
  return sum;
}

}  // namespace

template <class T>
SupernodalFactor<T>::SupernodalFactor(const Supernodes& supernodes, const BlockPattern& pattern, int threads,
                                      const std::string& simd, bool compact)
    : supernodes_(supernodes), kernels_(find_dense_kernels<T>(simd)), map_(map_assembly(supernodes, pattern)) {
  panel_begin_.push_back(0);
  for (std::int32_t s = 0; s < supernodes.count(); ++s)
    panel_begin_.push_back(panel_begin_.back() + rounded(supernodes.front(s) * supernodes.columns(s) + kPadding));
  panels_ = HugeBuffer<T>(panel_begin_.back());
  if (compact && kernels_.compact != nullptr) {
    compact_begin_.push_back(0);
    for (std::int32_t s = 0; s < supernodes.count(); ++s)
      compact_begin_.push_back(compact_begin_.back() + compact_panel_bytes(supernodes.front(s), supernodes.columns(s)));
    compact_ = HugeBuffer<std::byte>(compact_begin_.back());
  }
  plan(threads);
}

// An odd number of cache lines, so that the rows of a tile do not fall on the same few lines of the cache.
template <class T>
std::int64_t SupernodalFactor<T>::update_ld(std::int32_t s) const {
  constexpr std::int64_t line = 64 / sizeof(T);
  return (supernodes_.rows_below(s) + line - 1) / line * line + (supernodes_.rows_below(s) > 256 ? line : 0);
}

template <class T>
void SupernodalFactor<T>::plan(int threads) {
  const std::int32_t count = supernodes_.count();
  std::vector<double> flops(count), entries(count);
  std::vector<std::int64_t> update_size(count), side_size(count);
  std::int64_t longest = 0;
  for (std::int32_t s = 0; s < count; ++s) {
    const double below = static_cast<double>(supernodes_.rows_below(s));
    flops[s] = supernodes_.flops(s) + 10.0 * below * below;
    entries[s] = static_cast<double>(supernodes_.nonzeros(s));
    update_size[s] = below > 0 ? rounded(update_ld(s) * supernodes_.rows_below(s) + kPadding) : 0;
    side_size[s] = kRightSides * rounded(supernodes_.rows_below(s));
    longest = std::max(longest, supernodes_.front(s));
  }
  factor_threads_ = std::accumulate(flops.begin(), flops.end(), 0.0) < kThreadedFlops ? 1 : threads;
  const double enough = compact_.size() > 0 ? kThreadedCompact : kThreadedEntries;
  solve_threads_ = std::accumulate(entries.begin(), entries.end(), 0.0) < enough ? 1 : threads;
  factor_schedule_ = make_schedule(supernodes_, flops, factor_threads_, 4.0);
  solve_schedule_ = make_schedule(supernodes_, entries, solve_threads_, 2.0);
  updates_ = place_blocks(supernodes_, factor_schedule_, update_size);
  sides_ = place_blocks(supernodes_, solve_schedule_, side_size);
  shared_updates_ = HugeBuffer<T>(updates_.shared_size);
  shared_pending_ = HugeBuffer<T>(sides_.shared_size);
  side_ld_ = rounded(longest + kPadding);
  shared_sides_ = HugeBuffer<T>(kRightSides * side_ld_);
  bad_.assign(threads, -1);
  for (int k = 0; k < threads; ++k) {
    thread_updates_.emplace_back(updates_.thread_size);
    thread_pending_.emplace_back(sides_.thread_size);
    work_.emplace_back(kWorkEntries);
    side_work_.emplace_back(kRightSides * side_ld_);
  }
}

template <class T>
T* SupernodalFactor<T>::update(std::int32_t s, int thread) {
  return (updates_.shared[s] ? shared_updates_ : thread_updates_[thread]).data() + updates_.offset[s];
}

template <class T>
void SupernodalFactor<T>::report(std::int64_t column) {
  std::int64_t now = failed_;
  while (column < now && !failed_.compare_exchange_weak(now, column)) {
  }
}

template <class T>
std::int64_t SupernodalFactor<T>::factorise(const double* values) {
  values_ = values;
  failed_ = kNone;
  const auto subtrees = static_cast<std::int64_t>(factor_schedule_.subtrees.size());
  // The first column that fails counts; what is before it must still be tried, whoever finds it.
  const auto after_failure = [&](std::int32_t s) { return supernodes_.first[s] >= failed_; };
#pragma omp parallel num_threads(factor_threads_) if (factor_threads_ > 1)
  {
    const int thread = omp_get_thread_num();
    const FlushSubnormals flush;
#pragma omp for schedule(dynamic, 1)
    for (std::int64_t k = 0; k < subtrees; ++k) {
      const auto [first, last] = factor_schedule_.subtrees[k];
      for (std::int32_t s = first; s < last && !after_failure(s); ++s) eliminate_front(s, thread, false);
    }
    one_by_one(
        factor_schedule_.top.begin(), factor_schedule_.top.end(),
        [&](std::int32_t s) { return supernodes_.flops(s) > kSharedFlops; },
        [&](std::int32_t s, bool shared) { eliminate_front(s, thread, shared); }, after_failure);
  }
  return failed_ == kNone ? -1 : failed_.load();
}

template <class T>
void SupernodalFactor<T>::eliminate_front(std::int32_t s, int thread, bool shared) {
  assemble(s, values_, shared);
  add_children(s, thread, shared, true);
  if (const int bad = factor_panel(s, thread, shared); bad >= 0) {
    once(shared, [&] { report(supernodes_.first[s] + bad); });
    return;
  }
  if (compact_.size() > 0) pack_panel(s, shared);
  make_update(s, thread, shared);
  add_children(s, thread, shared, false);
}

template <class T>
void SupernodalFactor<T>::pack_panel(std::int32_t s, bool shared) {
  if constexpr (std::is_same_v<T, float>) {
    const std::int64_t front = supernodes_.front(s), columns = supernodes_.columns(s);
    for_each(shared, pieces(columns, kWide), [&](std::int64_t k) {
      const std::int64_t j = k * kWide;
      kernels_.compact->pack({front, j, std::min<std::int64_t>(columns, j + kWide)}, panel(s),
                             compact_.data() + compact_begin_[s] + compact_panel_bytes(front, j));
    });
  }
}

template <class T>
void SupernodalFactor<T>::assemble(std::int32_t s, const double* values, bool shared) {
  T* to = panel(s);
  const std::int64_t ld = supernodes_.front(s), columns = supernodes_.columns(s);
  for_each(shared, pieces(columns, kColumnsPerTask), [&](std::int64_t k) {
    const std::int64_t begin = k * kColumnsPerTask, end = std::min(columns, begin + kColumnsPerTask);
    std::fill(to + begin * ld, to + end * ld, T(0));
  });
  once(shared, [&] {
    for (std::int64_t k = map_.block_begin[s]; k < map_.block_begin[s + 1]; ++k) {
      const AssemblyMap::Block& block = map_.blocks[k];
      const double* v = values + 9 * static_cast<std::int64_t>(block.block);
      T* target = to + block.row + block.column * ld;
      const int down = block.transposed ? 1 : 3, right = block.transposed ? 3 : 1;
      for (int b = 0; b < 3; ++b)
        for (int a = 0; a < 3; ++a) target[a + b * ld] = static_cast<T>(v[a * down + b * right]);
    }
    for (std::int64_t k = map_.entry_begin[s]; k < map_.entry_begin[s + 1]; ++k)
      to[map_.entries[k].row + map_.entries[k].column * ld] = static_cast<T>(values[map_.entries[k].value]);
  });
}

// What the children leave for the panel, or for the update matrix.
template <class T>
void SupernodalFactor<T>::add_children(std::int32_t s, int thread, bool shared, bool into_panel) {
  if (!into_panel && supernodes_.rows_below(s) == 0) return;  // there is no update matrix
  const std::int64_t columns = supernodes_.columns(s), ld = into_panel ? supernodes_.front(s) : update_ld(s);
  T* front = into_panel ? panel(s) : update(s, thread) - columns * (ld + 1);
  for (const std::int32_t c : supernodes_.children(s)) {
    const std::int64_t rows = supernodes_.rows_below(c);
    const std::int32_t* positions = supernodes_.positions(c);
    const std::int64_t split = std::lower_bound(positions, positions + rows, columns) - positions;
    const std::int64_t begin = into_panel ? 0 : split, end = into_panel ? split : rows;
    const auto runs = supernodes_.runs(c);
    const std::int64_t piece = shared ? kColumnsPerTask : std::max<std::int64_t>(end - begin, 1);
    for_each(shared, pieces(end - begin, piece), [&](std::int64_t k) {
      kernels_.extend_add(front, ld, update(c, thread), update_ld(c), &runs.data()->start,
                          static_cast<std::int64_t>(runs.size()), begin + k * piece,
                          std::min(end, begin + (k + 1) * piece));
    });
  }
}

template <class T>
int SupernodalFactor<T>::factor_panel(std::int32_t s, int thread, bool shared) {
  const std::int64_t front = supernodes_.front(s), columns = supernodes_.columns(s);
  if (front * columns > kSmallPanel) return factor_wide_panel(s, thread, shared);
  once(shared, [&] { bad_[shared ? 0 : thread] = kernels_.factor(panel(s), front, front, columns); });
  return bad_[shared ? 0 : thread];
}

// Left-looking by blocks of kWide columns: the block takes the product of what is left of it, its own triangle is
// factorised by one thread, then the rows below are solved for.
template <class T>
int SupernodalFactor<T>::factor_wide_panel(std::int32_t s, int thread, bool shared) {
  const std::int64_t ld = supernodes_.front(s), columns = supernodes_.columns(s);
  T *from = panel(s), *work = work_[thread].data();
  int& bad = bad_[shared ? 0 : thread];
  for (std::int64_t j = 0; j < columns; j += kWide) {
    const std::int64_t width = std::min<std::int64_t>(kWide, columns - j), below = ld - j - width;
    T* block = from + j + j * ld;
    if (j > 0)
      for_each(shared, pieces(ld - j, kTask), [&](std::int64_t k) {
        const std::int64_t i = k * kTask;
        kernels_.subtract(block + i, ld, from + j + i, from + j, ld, std::min<std::int64_t>(kTask, ld - j - i), width,
                          j, i == 0, false, work);
      });
    once(shared, [&] {
      bad = kernels_.factor(block, ld, width, width);
      if (bad >= 0) bad += static_cast<int>(j);
    });
    if (bad >= 0) return bad;
    for_each(shared, pieces(below, kTask), [&](std::int64_t k) {
      const std::int64_t i = k * kTask;
      kernels_.solve_rows(block, ld, width, block + width + i, ld, std::min<std::int64_t>(kTask, below - i), work);
    });
  }
  return -1;
}

template <class T>
void SupernodalFactor<T>::make_update(std::int32_t s, int thread, bool shared) {
  const std::int64_t columns = supernodes_.columns(s), rows = supernodes_.rows_below(s), ld = supernodes_.front(s);
  const T* below = panel(s) + columns;
  T* to = update(s, thread);
  const std::int64_t strips = pieces(rows, kTask), ldu = update_ld(s);
  for_each(shared, strips * (strips + 1) / 2, [&](std::int64_t k) {
    std::int64_t across = 0;  // k counts down each column of pieces
    while (k >= strips - across) k -= strips - across++;
    const std::int64_t i = (across + k) * kTask, j = across * kTask;
    kernels_.subtract(to + i + j * ldu, ldu, below + i, below + j, ld, std::min<std::int64_t>(kTask, rows - i),
                      std::min<std::int64_t>(kTask, rows - j), columns, i == j, true, work_[thread].data());
  });
}

template SupernodalFactor<float>::SupernodalFactor(const Supernodes&, const BlockPattern&, int, const std::string&,
                                                   bool);
template SupernodalFactor<double>::SupernodalFactor(const Supernodes&, const BlockPattern&, int, const std::string&,
                                                    bool);
template std::int64_t SupernodalFactor<float>::factorise(const double*);
template std::int64_t SupernodalFactor<double>::factorise(const double*);

}  // namespace qlb
