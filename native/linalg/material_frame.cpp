#include "linalg/material_frame.hpp"

#include <algorithm>
#include <stdexcept>

namespace qlb {
namespace {

void times(const double* T, const double* v, double* out) {
  for (int k = 0; k < 3; ++k) out[k] = T[3 * k] * v[0] + T[3 * k + 1] * v[1] + T[3 * k + 2] * v[2];
}

void times_transpose(const double* T, const double* v, double* out) {
  for (int k = 0; k < 3; ++k) out[k] = T[k] * v[0] + T[3 + k] * v[1] + T[6 + k] * v[2];
}

}  // namespace

MaterialFrame::MaterialFrame(std::shared_ptr<const TetBlocks> blocks, std::span<const std::uint8_t> fixed, int threads)
    : geometry_(std::move(blocks), threads), threads_(threads) {
  if (static_cast<std::int64_t>(fixed.size()) != 3 * nodes())
    throw std::invalid_argument("fixed must have one entry per degree of freedom of the mesh");
  for (std::int64_t i = 0; i < nodes(); ++i)
    if (fixed[3 * i] || fixed[3 * i + 1] || fixed[3 * i + 2]) held_nodes_.push_back(i);
  maps_.resize(9 * nodes());
}

void MaterialFrame::carry(const double* x, const double* reference, double weight) {
  geometry_.nodal_maps(x, reference, weight, maps_.data());
  for (const std::int64_t i : held_nodes_)
    for (int k = 0; k < 9; ++k) maps_[9 * i + k] = k % 4 == 0 ? 1.0 : 0.0;
  carried_ = true;
}

std::array<double, 3> MaterialFrame::pull_back_at(std::int64_t node, const std::array<double, 3>& v) const {
  if (!carried_) return v;
  std::array<double, 3> out;
  times_transpose(&maps_[9 * node], v.data(), out.data());
  return out;
}

template <auto product>
void MaterialFrame::at_each_node(const double* v, double* out) const {
  if (!carried_) {
    std::copy_n(v, 3 * nodes(), out);
    return;
  }
#pragma omp parallel for schedule(static) num_threads(threads_) if (nodes() > 16384)
  for (std::int64_t i = 0; i < nodes(); ++i) product(&maps_[9 * i], v + 3 * i, out + 3 * i);
}

void MaterialFrame::pull_back(const double* v, double* out) const {
  at_each_node<times_transpose>(v, out);
}

void MaterialFrame::push_forward(const double* v, double* out) const {
  at_each_node<times>(v, out);
}

}  // namespace qlb
