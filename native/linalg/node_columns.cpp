#include "linalg/node_columns.hpp"

#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace qlb {
namespace {
constexpr std::int64_t kRowsPerTask = 1024, kColumnsPerTask = 8;
template <class T>
constexpr T kNotMade = std::numeric_limits<T>::quiet_NaN();
}  // namespace

template <class T>
NodeColumns<T>::NodeColumns(const Supernodes& supernodes, const SupernodalFactor<T>& factor,
                            std::span<const std::int32_t> row_of_dof, std::span<const std::int32_t> owner, int threads)
    : supernodes_(supernodes),
      factor_(factor),
      row_of_dof_(row_of_dof),
      owner_(owner),
      threads_(threads),
      rows_to_root_(supernodes.count()),
      column_of_node_(row_of_dof.size() / 3, -1) {
  for (std::int32_t s = supernodes.count(); s-- > 0;)
    rows_to_root_[s] =
        supernodes.columns(s) + (supernodes.parent[s] >= 0 ? rows_to_root_[supernodes.parent[s]] : std::int64_t{0});
}

template <class T>
bool NodeColumns<T>::held(std::int32_t node) const {
  const std::int32_t* row = &row_of_dof_[3 * static_cast<std::int64_t>(node)];
  return row[0] < 0 && row[1] < 0 && row[2] < 0;
}

template <class T>
std::int64_t NodeColumns<T>::bytes() const {
  std::int64_t sum = static_cast<std::int64_t>(gram_.size() * sizeof(T));
  for (const Column& column : columns_) sum += static_cast<std::int64_t>(column.values.size() * sizeof(T));
  return sum;
}

template <class T>
template <class F>
void NodeColumns<T>::for_each_range(const Column& column, const F& f) const {
  std::int64_t first = column.first, place = 0;
  for (std::int32_t s = column.supernode; s >= 0;) {
    std::int64_t end = supernodes_.first[s + 1];
    s = supernodes_.parent[s];
    if (s >= 0 && supernodes_.first[s] == end) continue;  // goes on without a gap
    f(first, place, end - first);
    place += end - first;
    if (s >= 0) first = supernodes_.first[s];
  }
}

// Room for the columns of new nodes; returns what is to be solved for, in elimination order.
template <class T>
auto NodeColumns<T>::add_columns(std::span<const std::int32_t> nodes) -> std::vector<Side> {
  std::vector<Side> sides;
  for (const std::int32_t node : nodes) {
    if (held(node) || find(node) >= 0) continue;
    const auto id = static_cast<std::int32_t>(columns_.size());
    column_of_node_[node] = id;
    std::int64_t first = std::numeric_limits<std::int64_t>::max();
    for (int axis = 0; axis < 3; ++axis)
      if (const std::int64_t row = row_of_dof_[3 * static_cast<std::int64_t>(node) + axis]; row >= 0) {
        sides.push_back({row, id, axis});
        first = std::min(first, row);
      }
    const std::int32_t s = owner_[first];
    const std::int64_t rows = rows_to_root_[s] - (first - supernodes_.first[s]);
    const std::int64_t ld = (rows + kPadding - 1) / kPadding * kPadding;
    columns_.push_back({s, first, rows, ld, Aligned<T>(3 * ld, T(0))});
    joined_.push_back(0);
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.row < b.row; });
  return sides;
}

template <class T>
std::vector<std::int32_t> NodeColumns<T>::union_of_paths(std::span<const Side> sides) const {
  std::vector<std::int32_t> path;
  for (const Side& side : sides)
    for (std::int32_t s = columns_[side.column].supernode; s >= 0; s = supernodes_.parent[s]) path.push_back(s);
  std::sort(path.begin(), path.end());
  path.erase(std::unique(path.begin(), path.end()), path.end());
  return path;
}

template <class T>
void NodeColumns<T>::solve_sides(std::span<const Side> sides, typename SupernodalFactor<T>::PathWork& work) {
  const std::vector<std::int32_t> path = union_of_paths(sides);
  T* y = work.y.data();
  for (std::size_t r = 0; r < sides.size(); ++r) y[sides[r].row + r * work.ld] = T(1);
  factor_.forward_sides_along(path, work);
  for (std::size_t r = 0; r < sides.size(); ++r) {
    Column& column = columns_[sides[r].column];
    T* to = column.begin() + sides[r].axis * column.ld;
    for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
      std::copy_n(y + first + r * work.ld, rows, to + place);
    });
  }
  for (std::size_t r = 0; r < sides.size(); ++r)
    for (const std::int32_t s : path)
      std::fill(y + supernodes_.first[s] + r * work.ld, y + supernodes_.first[s + 1] + r * work.ld, T(0));
}

template <class T>
void NodeColumns<T>::make(std::span<const std::int32_t> nodes) {
  const std::vector<Side> sides = add_columns(nodes);
  constexpr std::int64_t together = SupernodalFactor<T>::kPathSides;
  const auto batches = (static_cast<std::int64_t>(sides.size()) + together - 1) / together;
  if (batches == 0) return;
  while (static_cast<int>(work_.size()) < threads_) work_.emplace_back(factor_);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (batches > 1 && threads_ > 1)
  for (std::int64_t k = 0; k < batches; ++k) {
    const std::size_t begin = k * together;
    solve_sides(std::span(sides).subspan(begin, std::min<std::size_t>(together, sides.size() - begin)),
                work_[omp_get_thread_num()]);
  }
}

// Up to the root, from the first supernode on that is on the way up from both.
template <class T>
std::int64_t NodeColumns<T>::rows_in_common(std::int32_t s, std::int32_t t) const {
  while (s != t) {
    std::int32_t& lower = s < t ? s : t;
    lower = supernodes_.parent[lower];
    if (lower < 0) return 0;
  }
  return rows_to_root_[s];
}

// The blocks of `few` columns with column j, as far as they are not there yet: together where they share as many rows.
template <class T>
void NodeColumns<T>::make_gram(std::span<const std::int32_t> few, std::int32_t j) {
  std::array<std::int32_t, kColumnsPerTask> alike;
  std::size_t count = 0;
  std::int64_t rows = 0, shared = 0;
  std::int32_t last = -1;
  for (const std::int32_t i : few) {
    if (!std::isnan(gram_row(i, 0)[3 * std::int64_t{j}])) continue;
    if (columns_[i].supernode != last) shared = rows_in_common(last = columns_[i].supernode, columns_[j].supernode);
    const std::int64_t here = std::min({columns_[i].rows, columns_[j].rows, shared});
    if (count > 0 && here != rows) {
      make_gram({alike.data(), count}, j, rows);
      count = 0;
    }
    rows = here;
    alike[count++] = i;
  }
  if (count > 0) make_gram({alike.data(), count}, j, rows);
}

template <class T>
void NodeColumns<T>::make_gram(std::span<const std::int32_t> few, std::int32_t j, std::int64_t rows) {
  std::array<const T*, kColumnsPerTask> from;
  std::array<std::int64_t, kColumnsPerTask> from_ld;
  double g[9 * kColumnsPerTask];
  for (std::size_t k = 0; k < few.size(); ++k) {
    const Column& column = columns_[few[k]];
    from[k] = column.end();
    from_ld[k] = column.ld;
  }
  const Column& to = columns_[j];
  factor_.kernels().gram3(from.data(), from_ld.data(), static_cast<int>(few.size()), to.end(), to.ld, rows, g);
  const std::int64_t ld = gram_length(), at_j = 3 * std::int64_t{j};
  for (std::size_t k = 0; k < few.size(); ++k) {
    const std::int64_t at_i = 3 * std::int64_t{few[k]};
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d < 3; ++d)
        gram_[(at_i + c) * ld + at_j + d] = gram_[(at_j + d) * ld + at_i + c] = static_cast<T>(g[9 * k + 3 * c + d]);
  }
}

template <class T>
void NodeColumns<T>::reserve_gram() {
  if (count() <= capacity_) return;
  const std::int64_t wanted = std::max({std::int64_t{32}, count(), capacity_ + capacity_ / 2});
  const std::int64_t capacity = (wanted + kPadding - 1) / kPadding * kPadding, ld = 3 * capacity_;
  Aligned<T> gram(9 * capacity * capacity, kNotMade<T>);
  for (std::int64_t k = 0; k < ld; ++k) std::copy_n(gram_.data() + k * ld, ld, gram.data() + k * 3 * capacity);
  gram_ = std::move(gram);
  capacity_ = capacity;
}

template <class T>
void NodeColumns<T>::join(std::span<const std::int32_t> columns) {
  reserve_gram();
  std::vector<std::int32_t> ids(columns.begin(), columns.end());
  std::sort(ids.begin(), ids.end(), [&](std::int32_t a, std::int32_t b) {
    return std::tuple(!joined_[a], first_row(a)) < std::tuple(!joined_[b], first_row(b));
  });
  const auto count = static_cast<std::int64_t>(ids.size());
  const std::int64_t known =
      std::find_if(ids.begin(), ids.end(), [&](std::int32_t k) { return !joined_[k]; }) - ids.begin();
  // A few columns stay in the cache while the others pass by.
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (threads_ > 1)
  for (std::int64_t first = known; first < count; first += kColumnsPerTask) {
    const std::int64_t last = std::min(count, first + kColumnsPerTask);
    for (std::int64_t b = 0; b < last; ++b) {
      const std::int64_t from = std::max(first, b);
      make_gram(std::span(ids).subspan(from, last - from), ids[b]);
    }
  }
  std::fill(joined_.begin(), joined_.end(), 0);
  for (const std::int32_t k : ids) joined_[k] = 1;
}

template <class T>
void NodeColumns<T>::gram_products(std::span<const NodeTerm* const> terms, T* work, T* out) const {
  // Whole vectors, so that a column's entries are summed in one way wherever it stands.
  const std::int64_t length = (3 * count() + kPadding - 1) / kPadding * kPadding;
  kernels().multiply_terms(terms.data(), static_cast<int>(terms.size()), gram_.data(), gram_length(), length, work,
                           out);
}

template <class T>
void NodeColumns<T>::dots(std::span<const std::int32_t> columns, const T* y, double* t) const {
  const auto count = static_cast<std::int64_t>(columns.size());
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && count > 64)
  for (std::int64_t k = 0; k < count; ++k) {
    const Column& column = columns_[columns[k]];
    std::fill_n(t + 3 * k, 3, 0.0);
    for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
      factor_.kernels().dots3(column.begin() + place, column.ld, y + first, rows, t + 3 * k);
    });
  }
}

// Threads share the rows, so each row takes its columns in one order.
template <class T>
void NodeColumns<T>::subtract(std::span<const std::int32_t> columns, const double* c, T* y) const {
  const std::int64_t size = supernodes_.first.back();
  const std::int64_t tasks = threads_ > 1 && columns.size() > 64 ? (size + kRowsPerTask - 1) / kRowsPerTask : 1;
  const std::int64_t rows_per_task = tasks > 1 ? kRowsPerTask : size;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (tasks > 1)
  for (std::int64_t task = 0; task < tasks; ++task) {
    const std::int64_t begin = task * rows_per_task, end = begin + rows_per_task;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Column& column = columns_[columns[k]];
      for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
        const std::int64_t from = std::max(first, begin), to = std::min(first + rows, end);
        if (from < to)
          factor_.kernels().subtract3(column.begin() + place + from - first, column.ld, c + 3 * k, y + from, to - from);
      });
    }
  }
}

template class NodeColumns<float>;
template class NodeColumns<double>;

}  // namespace qlb
