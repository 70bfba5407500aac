// Phi(x) = sum over elements of rest volume times eta/c |E(x) - E_b|^2, E the Green strain and E_b a combination of
// those of earlier positions.
#pragma once

#include <memory>
#include <span>

#include "elements/elastic_energy.hpp"

namespace qlb {

class Viscosity : public ElasticEnergy {
 public:
  // eta (elements) [Pa s]
  Viscosity(std::shared_ptr<const TetBlocks> blocks, std::span<const double> eta, int threads);

  // Starts a stage: E_b = 0, k = eta/c.
  void clear_base(double c);
  // E_b += weight E(x)
  void add_base(double weight, const double* x);

 private:
  std::shared_ptr<const TetBlocks> blocks_;
  Aligned<double> eta_;  // (packs, kLanes)
  int threads_;
};

}  // namespace qlb
