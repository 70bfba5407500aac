// The one loop over elements that serves every material. V is a SIMD vector, M<V> a material
// (materials/material.hpp). Functions that are not templates over V are static: each SIMD level keeps its
// own.
#pragma once

#include "elements/kernels.hpp"
#include "elements/lanes.hpp"
#include "materials/material.hpp"
#include "materials/viscous.hpp"
#include "simd/svd3.hpp"

namespace qlb {

// Rest shape and parameters of V::size elements: lanes [lane, lane + V::size) of a pack.
template <class V>
struct Tets {
  Mat3<V> Dm_inverse;
  V volume;
  const std::int64_t* vertex;  // vertex[a * kLanes + lane]
  const std::int32_t* pair;
  std::int64_t pack;
  int lane;

  Tets(const ChunkData& chunk, std::int64_t pack, int lane) : pack(pack), lane(lane) {
    for (int k = 0; k < 9; ++k)
      Dm_inverse(k / 3, k % 3) = V::load_aligned(chunk.shape + (pack * 9 + k) * kLanes + lane);
    volume = V::load_aligned(chunk.volume + pack * kLanes + lane);
    vertex = chunk.vertex + pack * 4 * kLanes + lane;
    pair = chunk.pair + pack * kPairs * kLanes + lane;
  }

  // Where these elements' entries start in a table (packs, count, kLanes) of the chunk.
  const double* in_table(const double* table, std::int64_t count) const { return table + pack * count * kLanes + lane; }

  Mat3<V> deformation_gradient(const double* positions) const {
    const Vec3<V> x0 = Gather<V>::positions(positions, vertex);
    Mat3<V> Ds;
    for (int a = 0; a < 3; ++a) {
      const Vec3<V> xa = Gather<V>::positions(positions, vertex + (a + 1) * kLanes);
      set_column(Ds, a, {xa[0] - x0[0], xa[1] - x0[1], xa[2] - x0[2]});
    }
    return Ds * Dm_inverse;
  }

  // Gradient of the shape function of vertex a = 1, 2, 3; that of vertex 0 is minus their sum.
  Vec3<V> shape_gradient(int a) const { return {Dm_inverse(a - 1, 0), Dm_inverse(a - 1, 1), Dm_inverse(a - 1, 2)}; }
};

// The material of V::size elements whose parameters (count, kLanes) start at `lanes`.
template <class M, class V>
M load_material(const double* lanes, const Program* program) {
  if constexpr (takes_program<M>) {
    return M(lanes, kLanes, *program);
  } else {
    V parameters[M::parameter_count];
    for (int k = 0; k < M::parameter_count; ++k) parameters[k] = V::load_unaligned(lanes + k * kLanes);
    return M(parameters);
  }
}

template <class M>
std::int64_t parameter_count(const Program* program) {
  if constexpr (takes_program<M>) {
    return program->parameter_count;
  } else {
    return M::parameter_count;
  }
}

// visit(tets, material) for every vector of elements of the chunk, in order.
template <class V, template <class> class M, class Visit>
void for_each_tets(const ChunkData& chunk, const Visit& visit) {
  const std::int64_t count = parameter_count<M<V>>(chunk.program);
  for (std::int64_t pack = 0; pack < chunk.packs; ++pack)
    for (int lane = 0; lane < kLanes; lane += static_cast<int>(V::size)) {
      const Tets<V> tets(chunk, pack, lane);
      visit(tets, load_material<M<V>, V>(tets.in_table(chunk.parameters, count), chunk.program));
    }
}

// The chunk's own copy of its node positions, padded to 4 doubles a node.
static inline void load_positions(const ChunkData& chunk, const double* x, double* positions) {
  for (std::int64_t s = 0; s < chunk.slots; ++s)
    for (int c = 0; c < 3; ++c) positions[kStride * s + c] = x[3 * static_cast<std::int64_t>(chunk.slot_node[s]) + c];
}

static inline void set_zero(double* values, std::int64_t count) {
  for (std::int64_t k = 0; k < count; ++k) values[k] = 0.0;
}

template <class V, template <class> class M>
double chunk_value(const ChunkData& chunk, const double* x, double* positions) {
  load_positions(chunk, x, positions);
  V total(0.0);
  for_each_tets<V, M>(chunk, [&](const Tets<V>& tets, const M<V>& material) {
    total += tets.volume * material.energy(tets.deformation_gradient(positions));
  });
  return xsimd::hadd(total);
}

// Adds dE/dx_a = volume P grad N_a at the vertices a.
template <class V>
void scatter_stress(const Tets<V>& tets, const Mat3<V>& P, double* slot_gradient) {
  Vec3<V> force[4];
  for (int i = 0; i < 3; ++i) force[0][i] = V(0.0);
  for (int a = 1; a < 4; ++a) {
    const Vec3<V> b = tets.shape_gradient(a);
    for (int i = 0; i < 3; ++i) {
      force[a][i] = tets.volume * (P(i, 0) * b[0] + P(i, 1) * b[1] + P(i, 2) * b[2]);
      force[0][i] -= force[a][i];
    }
  }
  for (int a = 0; a < 4; ++a) Scatter<V>::add_vector(force[a], tets.vertex + a * kLanes, slot_gradient);
}

template <class V, template <class> class M>
double chunk_value_gradient(const ChunkData& chunk, const double* x, double* positions, double* slot_gradient) {
  load_positions(chunk, x, positions);
  set_zero(slot_gradient, kStride * chunk.slots);
  V total(0.0);
  for_each_tets<V, M>(chunk, [&](const Tets<V>& tets, const M<V>& material) {
    Mat3<V> P;
    total += tets.volume * material.energy_stress(tets.deformation_gradient(positions), P);
    scatter_stress(tets, P, slot_gradient);
  });
  return xsimd::hadd(total);
}

// The same of the material and of its viscosity together: they share what costs most, F and the sum at the vertices.
template <class V, template <class> class M>
double chunk_viscous_value_gradient(const ChunkData& chunk, const double* viscosity, const double* x, double* positions,
                                    double* slot_gradient) {
  load_positions(chunk, x, positions);
  set_zero(slot_gradient, kStride * chunk.slots);
  V total(0.0);
  for_each_tets<V, M>(chunk, [&](const Tets<V>& tets, const M<V>& material) {
    const double* parameters = tets.in_table(viscosity, Viscous<V>::parameter_count);
    const auto viscous = load_material<Viscous<V>, V>(parameters, nullptr);
    const Mat3<V> F = tets.deformation_gradient(positions);
    Mat3<V> P, more;
    V energy = material.energy_stress(F, P);
    energy += viscous.energy_stress(F, more);
    total += tets.volume * energy;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P(i, j) += more(i, j);
    scatter_stress(tets, P, slot_gradient);
  });
  return xsimd::hadd(total);
}

// H_ab = volume sum_kl (grad N_a)_k C_(ik)(jl) (grad N_b)_l for the six pairs of vertices 1, 2, 3.
template <class V>
void contract_stiffness(const Stiffness9<V>& C, const Tets<V>& tets, Mat3<V> (&H)[3][3]) {
  for (int b = 0; b < 3; ++b) {
    const Vec3<V> gb = tets.shape_gradient(b + 1);
    V T[9][3];
    for (int p = 0; p < 9; ++p)
      for (int j = 0; j < 3; ++j) T[p][j] = C(p, 3 * j) * gb[0] + C(p, 3 * j + 1) * gb[1] + C(p, 3 * j + 2) * gb[2];
    for (int a = 0; a <= b; ++a) {
      const Vec3<V> ga = tets.shape_gradient(a + 1);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          H[a][b](i, j) = tets.volume * (ga[0] * T[3 * i][j] + ga[1] * T[3 * i + 1][j] + ga[2] * T[3 * i + 2][j]);
    }
  }
}

template <class V>
Spectrum<V> project_psd(Spectrum<V> H) {
  H.scaling = project_psd(H.scaling);
  for (int k = 0; k < 3; ++k) {
    H.twist[k] = xsimd::max(H.twist[k], V(0.0));
    H.flip[k] = xsimd::max(H.flip[k], V(0.0));
  }
  return H;
}

// Calls with_spectrum(spectrum, svd) or with_stiffness(C), whichever form of the Hessian the material has for this.
template <class V, class M, class Stiff, class Spectral>
void visit_hessian(const M& material, const Mat3<V>& F, bool project, const Stiff& with_stiffness,
                   const Spectral& with_spectrum) {
  constexpr HessianForm form = M::hessian_form;
  constexpr bool has_spectrum = form == HessianForm::kSpectrum || form == HessianForm::kStiffnessAndSpectrum;
  if constexpr (has_spectrum) {
    if (project || form == HessianForm::kSpectrum) {
      const Svd3<V> svd = svd3(F);
      const Spectrum<V> spectrum = material.spectrum(svd.sigma);
      return with_spectrum(project ? project_psd(spectrum) : spectrum, svd);
    }
  }
  if constexpr (form == HessianForm::kStiffnessPair) {
    if (project) return with_stiffness(material.projected_stiffness(F));
  }
  if constexpr (form != HessianForm::kSpectrum) with_stiffness(material.stiffness(F));
}

// The same blocks from a spectrum: contract in the frame of the SVD, where C is sparse, and turn each block
// back.
template <class V>
void contract_spectrum(const Spectrum<V>& S, const Svd3<V>& svd, const Tets<V>& tets, Mat3<V> (&H)[3][3]) {
  V same[3], mixed[3];  // C_(ij)(ij) and C_(ij)(ji), at the index left out
  for (int k = 0; k < 3; ++k) {
    same[k] = V(0.5) * (S.flip[k] + S.twist[k]);
    mixed[k] = V(0.5) * (S.flip[k] - S.twist[k]);
  }
  Vec3<V> g[3], weighted[3];
  for (int a = 0; a < 3; ++a) {
    g[a] = transpose_times(svd.R, tets.shape_gradient(a + 1));
    weighted[a] = {tets.volume * g[a][0], tets.volume * g[a][1], tets.volume * g[a][2]};
  }
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a <= b; ++a) {
      const Vec3<V>& w = weighted[a];
      Mat3<V> local;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          if (i == j) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
            local(i, i) = S.scaling(i, i) * w[i] * g[b][i] + same[i2] * w[i1] * g[b][i1] + same[i1] * w[i2] * g[b][i2];
          } else {
            local(i, j) = S.scaling(i, j) * w[i] * g[b][j] + mixed[3 - i - j] * w[j] * g[b][i];
          }
        }
      const Mat3<V> left = svd.U * local;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          if (a == b && j < i)  // symmetric
            H[a][b](i, j) = H[a][b](j, i);
          else
            H[a][b](i, j) = left(i, 0) * svd.U(j, 0) + left(i, 1) * svd.U(j, 1) + left(i, 2) * svd.U(j, 2);
        }
    }
}

// Adds the ten blocks (b, a), a <= b, of each element; those of vertex 0 follow from the other six.
template <class V>
void scatter_blocks(const Tets<V>& tets, const Mat3<V> (&H)[3][3], double* slot_blocks) {
  Mat3<V> first[4];  // block (a, 0), a = 0..3
  const auto entry = [&](int a, int b, int i, int j) { return a <= b ? H[a][b](i, j) : H[b][a](j, i); };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      first[0](i, j) = V(0.0);
      for (int a = 0; a < 3; ++a) {
        first[a + 1](i, j) = -(entry(a, 0, i, j) + entry(a, 1, i, j) + entry(a, 2, i, j));
        first[0](i, j) -= first[a + 1](i, j);
      }
    }
  int pair = 0;
  for (int a = 0; a < 4; ++a) Scatter<V>::add_matrix(first[a], tets.pair + pair++ * kLanes, slot_blocks);
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      Mat3<V> lower;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) lower(i, j) = H[a][b](j, i);
      Scatter<V>::add_matrix(lower, tets.pair + pair++ * kLanes, slot_blocks);
    }
}

template <class V, template <class> class M>
void chunk_hessian(const ChunkData& chunk, const double* x, bool project, double* positions, double* slot_blocks) {
  load_positions(chunk, x, positions);
  set_zero(slot_blocks, 9 * chunk.block_slots);
  for_each_tets<V, M>(chunk, [&](const Tets<V>& tets, const M<V>& material) {
    const Mat3<V> F = tets.deformation_gradient(positions);
    Mat3<V> H[3][3];
    visit_hessian<V>(
        material, F, project, [&](const Stiffness9<V>& C) { contract_stiffness(C, tets, H); },
        [&](const Spectrum<V>& S, const Svd3<V>& svd) { contract_spectrum(S, svd, tets, H); });
    scatter_blocks(tets, H, slot_blocks);
  });
}

// C = sum over the frame of the SVD, as a full 9x9 matrix.
template <class V>
Stiffness9<V> expand_spectrum(const Spectrum<V>& S, const Svd3<V>& svd) {
  Stiffness9<V> C;
  for (int p = 0; p < 9; ++p)
    for (int q = 0; q <= p; ++q) C(p, q) = V(0.0);
  const auto add = [&](const V& weight, int i, int k, int j, int l) {
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q)
        C(p, q) += weight * (svd.U(p / 3, i) * svd.R(p % 3, k)) * (svd.U(q / 3, j) * svd.R(q % 3, l));
  };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      add(S.scaling(i, j), i, i, j, j);
      if (i == j) continue;
      const int k = 3 - i - j;
      add(V(0.5) * (S.flip[k] + S.twist[k]), i, j, i, j);
      add(V(0.5) * (S.flip[k] - S.twist[k]), i, j, j, i);
    }
  return C;
}

template <class V, template <class> class M>
void lanes_density(const double* F_lanes, const double* parameter_lanes, const Program* program, bool project,
                   double* energy, double* stress, double* stiffness) {
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(V::size)) {
    Mat3<V> F;
    for (int k = 0; k < 9; ++k) F(k / 3, k % 3) = V::load_unaligned(F_lanes + k * kLanes + lane);
    const M<V> material = load_material<M<V>, V>(parameter_lanes + lane, program);
    Mat3<V> P;
    material.energy_stress(F, P).store_unaligned(energy + lane);
    for (int k = 0; k < 9; ++k) P(k / 3, k % 3).store_unaligned(stress + k * kLanes + lane);
    Stiffness9<V> C;
    visit_hessian<V>(
        material, F, project, [&](const Stiffness9<V>& exact) { C = exact; },
        [&](const Spectrum<V>& S, const Svd3<V>& svd) { C = expand_spectrum(S, svd); });
    for (int k = 0; k < 81; ++k) C(k / 9, k % 9).store_unaligned(stiffness + k * kLanes + lane);
  }
}

template <class V, template <class> class M>
MaterialKernels make_kernels() {
  int count = kAsProgram;
  if constexpr (!takes_program<M<V>>) count = M<V>::parameter_count;
  return {M<V>::name,
          count,
          chunk_value<V, M>,
          chunk_value_gradient<V, M>,
          chunk_viscous_value_gradient<V, M>,
          chunk_hessian<V, M>,
          lanes_density<V, M>};
}

}  // namespace qlb
