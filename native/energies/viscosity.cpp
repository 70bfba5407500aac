#include "energies/viscosity.hpp"

#include <algorithm>
#include <vector>

namespace qlb {
namespace {

constexpr int kParameters = 7;

using Strain = double[6];

// E = (F^T F - 1)/2 of the element in one lane of a pack: xx, yy, zz, yz, zx, xy.
void green_strain(const TetBlocks& blocks, const Chunk& chunk, std::int64_t pack, int lane, const double* x,
                  Strain& strain) {
  const std::int32_t* node = blocks.slot_node.data() + chunk.first_slot;
  const std::int64_t* vertex = blocks.vertex.data() + pack * 4 * kLanes + lane;
  const double* Dm_inverse = blocks.shape.data() + pack * 9 * kLanes + lane;
  const auto position = [&](int a) { return x + 3 * static_cast<std::int64_t>(node[vertex[a * kLanes]]); };
  double F[3][3] = {};
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) F[i][j] += (position(a + 1)[i] - position(0)[i]) * Dm_inverse[(3 * a + j) * kLanes];
  for (int m = 0; m < 6; ++m) {
    const int j = m < 3 ? m : (m + 1) % 3, l = m < 3 ? m : (m + 2) % 3;
    strain[m] = 0.5 * (F[0][j] * F[0][l] + F[1][j] * F[1][l] + F[2][j] * F[2][l] - (m < 3 ? 1.0 : 0.0));
  }
}

}  // namespace

Viscosity::Viscosity(std::shared_ptr<const TetBlocks> blocks, std::span<const double> eta, int threads)
    : ElasticEnergy(blocks, "viscous", std::vector<double>(kParameters * eta.size()), threads, "", nullptr),
      blocks_(blocks),
      eta_(blocks->scatter(eta, 1)),
      threads_(threads) {}

void Viscosity::clear_base(double c) {
  double* parameters = this->parameters();
  for (std::int64_t pack = 0; pack < blocks_->packs(); ++pack) {
    double* out = parameters + pack * kParameters * kLanes;
    for (int lane = 0; lane < kLanes; ++lane) out[lane] = eta_[pack * kLanes + lane] / c;
    std::fill(out + kLanes, out + kParameters * kLanes, 0.0);
  }
}

void Viscosity::add_base(double weight, const double* x) {
  double* parameters = this->parameters();
  const auto chunks = static_cast<std::int64_t>(blocks_->chunks.size());
#pragma omp parallel for schedule(static) num_threads(threads_)
  for (std::int64_t k = 0; k < chunks; ++k) {
    const Chunk& chunk = blocks_->chunks[k];
    for (std::int64_t pack = chunk.first_pack; pack < chunk.first_pack + chunk.packs; ++pack)
      for (int lane = 0; lane < kLanes; ++lane) {
        Strain strain;
        green_strain(*blocks_, chunk, pack, lane, x, strain);
        double* base = parameters + (pack * kParameters + 1) * kLanes + lane;
        for (int m = 0; m < 6; ++m) base[m * kLanes] += weight * strain[m];
      }
  }
}

}  // namespace qlb
