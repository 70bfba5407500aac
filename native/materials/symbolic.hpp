// A density that is given at run time as a function of the invariants (src/qlb/materials/symbolic.py): a program over
// SIMD registers, run for V::size elements at once.
#pragma once

#include "materials/invariant_material.hpp"
#include "materials/program.hpp"

namespace qlb {
namespace detail {

template <class V>
V not_a_number() {
  return V(std::numeric_limits<double>::quiet_NaN());
}

// log x, minus infinity for 0, NaN for x < 0: x^p = exp(p log x) is then right for x = 0 too.
template <class V>
V log_or_limit(const V& x) {
  const V limit = xsimd::select(x == V(0.0), V(-std::numeric_limits<double>::infinity()), not_a_number<V>());
  return xsimd::select(x > V(0.0), xsimd::log(x), limit);
}

// The real cube root, NaN for x < 0: exp(log(x)/3) and a step of Newton, several times faster than xsimd's.
template <class V>
V cube_root(const V& x) {
  const V r = xsimd::exp(V(1.0 / 3.0) * log_or_limit(x));
  return xsimd::select(x > V(0.0), r - V(1.0 / 3.0) * (r - x / (r * r)), r);
}

template <class V>
V sign(const V& x) {
  return xsimd::select(x > V(0.0), V(1.0), xsimd::select(x < V(0.0), V(-1.0), x));
}

// The operations that take long, out of the interpreter's loop, whose registers they would crowd.
template <class V>
[[gnu::noinline]] V function(Operation operation, const V& a, const V& b) {
  switch (operation) {
    case Operation::kPower:
      return xsimd::exp(b * log_or_limit(a));
    case Operation::kCbrt:
      return cube_root(a);
    case Operation::kExp:
      return xsimd::exp(a);
    case Operation::kLog:
      return log_or_nan(a);
    case Operation::kSin:
      return xsimd::sin(a);
    case Operation::kCos:
      return xsimd::cos(a);
    case Operation::kTan:
      return xsimd::tan(a);
    case Operation::kSinh:
      return xsimd::sinh(a);
    case Operation::kCosh:
      return xsimd::cosh(a);
    case Operation::kTanh:
      return xsimd::tanh(a);
    case Operation::kAtan:
      return xsimd::atan(a);
    default:
      return not_a_number<V>();
  }
}

template <class V>
void run_operations(const InstructionList& list, V* r) {
  for (const Instruction* i = list.begin; i != list.end; ++i) {
    const V& a = r[i->a];
    V& target = r[i->target];
    switch (i->operation) {
      case Operation::kAdd:
        target = a + r[i->b];
        break;
      case Operation::kSubtract:
        target = a - r[i->b];
        break;
      case Operation::kMultiply:
        target = a * r[i->b];
        break;
      case Operation::kDivide:
        target = a / r[i->b];
        break;
      case Operation::kMultiplyAdd:
        target = xsimd::fma(a, r[i->b], r[i->c]);
        break;
      case Operation::kMultiplySubtract:
        target = xsimd::fms(a, r[i->b], r[i->c]);
        break;
      case Operation::kSubtractProduct:
        target = xsimd::fnma(a, r[i->b], r[i->c]);
        break;
      case Operation::kNegate:
        target = -a;
        break;
      case Operation::kSqrt:
        target = xsimd::sqrt(a);
        break;
      case Operation::kAbs:
        target = xsimd::abs(a);
        break;
      case Operation::kSign:
        target = sign(a);
        break;
      default:
        target = function(i->operation, a, r[i->operation == Operation::kPower ? i->b : i->a]);
    }
  }
}

// Runs `list` for the elements whose parameters are at parameters[k * kLanes], and fills `outputs`.
template <class V>
[[gnu::noinline]] void run_list(const InstructionList& list, const Invariants<V>& I, const double* parameters,
                                int parameter_count, int stride, V* outputs, int output_count) {
  V registers[kMaxRegisters];
  registers[0] = I.I1;
  registers[1] = I.I2;
  registers[2] = I.J;
  V* next = registers + kInvariantCount;
  for (int k = 0; k < parameter_count; ++k) *next++ = V::load_unaligned(parameters + k * stride);
  for (int k = 0; k < list.constant_count; ++k) *next++ = V(list.constants[k]);
  run_operations(list, registers);
  for (int k = 0; k < output_count; ++k) outputs[k] = registers[list.outputs[k]];
}

}  // namespace detail

// `WithI2`: whether psi depends on I2; without, its terms cost nothing.
template <class V, class Self, bool WithI2>
class ProgramMaterial : public InvariantMaterial<V, Self> {
 public:
  static constexpr bool takes_program = true;
  static constexpr bool uses_I2 = WithI2;

  // `parameters` (parameter_count, stride), of which the first V::size of each row are read.
  ProgramMaterial(const double* parameters, int stride, const Program& program)
      : parameters_(parameters), stride_(stride), program_(&program) {}

  V psi(const Invariants<V>& I) const {
    V psi;
    run(program_->energy, I, &psi, kEnergyOutputs);
    return psi;
  }

  V psi_and_slopes(const Invariants<V>& I, InvariantDerivatives<V>& d) const {
    V out[kSlopeOutputs];
    run(program_->slopes, I, out, kSlopeOutputs);
    d.d1 = out[1];
    d.d2 = out[2];
    d.dJ = out[3];
    return out[0];
  }

  InvariantDerivatives<V> derivatives(const Invariants<V>& I) const {
    V out[kDerivativeOutputs];
    run(program_->derivatives, I, out, kDerivativeOutputs);
    return {out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8]};
  }

 private:
  void run(const InstructionList& list, const Invariants<V>& I, V* outputs, int count) const {
    detail::run_list<V>(list, I, parameters_, program_->parameter_count, stride_, outputs, count);
  }

  const double* parameters_;
  int stride_;
  const Program* program_;
};

template <class V>
struct Symbolic : ProgramMaterial<V, Symbolic<V>, false> {
  static constexpr const char* name = "symbolic";
  using ProgramMaterial<V, Symbolic<V>, false>::ProgramMaterial;
};

template <class V>
struct SymbolicWithI2 : ProgramMaterial<V, SymbolicWithI2<V>, true> {
  static constexpr const char* name = "symbolic-I2";
  using ProgramMaterial<V, SymbolicWithI2<V>, true>::ProgramMaterial;
};

QLB_MATERIAL(Symbolic);
QLB_MATERIAL(SymbolicWithI2);

}  // namespace qlb
