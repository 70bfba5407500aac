// A density given at run time, as the element kernels read it: plain pointers into an `OwnedProgram`
// (materials/owned_program.hpp), which has checked every index.
//
// A program is a list of operations over SIMD registers. A run starts with registers filled in this order: the
// invariants I1, I2, J, the parameters of the element, the constants of the list.
#pragma once

#include <cstdint>

namespace qlb {

enum class Operation : std::uint8_t {
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kMultiplyAdd,       // a b + c
  kMultiplySubtract,  // a b - c
  kSubtractProduct,   // c - a b
  kNegate,
  kPower,  // a^b, NaN for a < 0
  kSqrt,
  kCbrt,  // NaN for a < 0
  kExp,
  kLog,
  kSin,
  kCos,
  kTan,
  kSinh,
  kCosh,
  kTanh,
  kAtan,
  kAbs,
  kSign,
};

inline constexpr int kInvariantCount = 3;
inline constexpr int kMaxRegisters = 128;  // 8 KiB of the stack at the widest SIMD level
inline constexpr int kMaxOperations = 4096;

struct Instruction {
  Operation operation;
  std::uint8_t target, a, b, c;  // registers
};

struct InstructionList {
  const Instruction* begin;
  const Instruction* end;
  const double* constants;
  int constant_count;
  const std::uint8_t* outputs;  // registers
};

struct Program {
  int parameter_count;
  InstructionList energy;       // psi
  InstructionList slopes;       // psi, d1, d2, dJ
  InstructionList derivatives;  // d1, d2, dJ, d11, d22, dJJ, d1J, d2J, d12
};

inline constexpr int kEnergyOutputs = 1, kSlopeOutputs = 4, kDerivativeOutputs = 9;

}  // namespace qlb
