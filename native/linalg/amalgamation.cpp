#include "linalg/amalgamation.hpp"

#include <algorithm>
#include <numeric>

namespace qlb {
namespace {

// A supernode while they are merged: its vertices are a linked list of ranges.
struct Group {
  std::int64_t columns = 0, below = 0;
  std::int32_t parent = -1;
  bool merged = false;  // into its parent
};

// Model of the time that a front costs, in operations of the dense kernels, fitted to timings: a fixed part, its panel
// (whose bytes each solve reads too), its update matrix (stored, then added into the parent), and the arithmetic.
double front_cost(double columns, double below) {
  const double front = columns + below;
  return 4000.0 + 16.0 * columns * front + 14.0 * below * below + front_flops(columns, below);
}

std::vector<Group> fundamental_supernodes(const Graph& graph, std::span<const std::int32_t> weight,
                                          std::vector<std::int32_t>& group_of) {
  const std::vector<std::int32_t> parent = elimination_tree(graph);
  const std::vector<std::int64_t> length = column_counts(graph, parent, weight);
  std::vector<Group> groups;
  group_of.resize(graph.size());
  for (std::int32_t j = 0; j < graph.size(); ++j) {
    if (j == 0 || parent[j - 1] != j || length[j - 1] != length[j] + weight[j - 1]) groups.emplace_back();
    group_of[j] = static_cast<std::int32_t>(groups.size()) - 1;
    groups.back().columns += weight[j];
    groups.back().below = length[j] - weight[j];
  }
  for (std::int32_t j = 0; j < graph.size(); ++j)
    if (parent[j] >= 0 && group_of[parent[j]] != group_of[j]) groups[group_of[j]].parent = group_of[parent[j]];
  return groups;
}

// Merges children into parents, bottom up; in each parent the child that saves most first.
void merge(std::vector<Group>& groups) {
  const auto saving = [](const Group& child, const Group& parent) {
    return front_cost(child.columns, child.below) + front_cost(parent.columns, parent.below) -
           front_cost(child.columns + parent.columns, parent.below);
  };
  std::vector<std::vector<std::int32_t>> children(groups.size());
  for (std::size_t p = 0; p < groups.size(); ++p) {
    std::vector<std::int32_t>& open = children[p];
    while (!open.empty()) {
      std::size_t best = 0;
      double most = 0.0;
      for (std::size_t k = 0; k < open.size(); ++k)
        if (const double gain = saving(groups[open[k]], groups[p]); gain > most) most = gain, best = k;
      if (most <= 0.0) break;
      groups[open[best]].merged = true;
      groups[p].columns += groups[open[best]].columns;
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(best));
    }
    if (groups[p].parent >= 0) children[groups[p].parent].push_back(static_cast<std::int32_t>(p));
  }
}

// Weight of a subtree for the order of siblings: the largest update matrix pending in it.
std::vector<double> subtree_weights(std::span<const std::int32_t> parent, const std::vector<Group>& groups,
                                    std::span<const std::int32_t> kept) {
  std::vector<double> weight(parent.size(), 0.0);
  for (std::size_t k = 0; k < parent.size(); ++k) {
    const auto front = static_cast<double>(groups[kept[k]].columns + groups[kept[k]].below);
    weight[k] = std::max(weight[k], front * front);
    if (parent[k] >= 0) weight[parent[k]] = std::max(weight[parent[k]], weight[k]);
  }
  return weight;
}

}  // namespace

double front_flops(double columns, double below) {
  const auto squares = [](double n) { return n * (n + 1.0) * (2.0 * n + 1.0) / 6.0; };  // 1 + 4 + ... + n^2
  return squares(columns + below) - squares(below);
}

Partition amalgamate(const Graph& graph, std::span<const std::int32_t> weight) {
  std::vector<std::int32_t> group_of;
  std::vector<Group> groups = fundamental_supernodes(graph, weight, group_of);
  merge(groups);

  // What remains, numbered anew; a merged group stands for the nearest ancestor that does.
  std::vector<std::int32_t> number(groups.size()), kept;
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (!groups[g].merged) number[g] = static_cast<std::int32_t>(kept.size()), kept.push_back(static_cast<int>(g));
  for (std::size_t g = groups.size(); g-- > 0;)
    if (groups[g].merged) number[g] = number[groups[g].parent];
  std::vector<std::int32_t> parent(kept.size());
  for (std::size_t k = 0; k < kept.size(); ++k)
    parent[k] = groups[kept[k]].parent < 0 ? -1 : number[groups[kept[k]].parent];

  const std::vector<std::int32_t> sequence = postorder(parent, subtree_weights(parent, groups, kept));
  std::vector<std::int32_t> place(sequence.size());
  for (std::size_t k = 0; k < sequence.size(); ++k) place[sequence[k]] = static_cast<std::int32_t>(k);

  Partition result;
  for (const std::int32_t k : sequence) result.parent.push_back(parent[k] < 0 ? -1 : place[parent[k]]);
  result.first.assign(sequence.size() + 1, 0);
  for (std::int32_t& g : group_of) ++result.first[(g = place[number[g]]) + 1];
  std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
  std::vector<std::int32_t> next(result.first.begin(), result.first.end());
  result.order.resize(graph.size());
  for (std::int32_t j = 0; j < graph.size(); ++j) result.order[next[group_of[j]]++] = j;
  return result;
}

}  // namespace qlb
