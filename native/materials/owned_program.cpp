#include "materials/owned_program.hpp"

#include <bitset>
#include <cmath>
#include <stdexcept>

namespace qlb {
namespace {

struct OperationInfo {
  const char* name;
  int operands;
};

constexpr OperationInfo kOperations[] = {
    {"add", 2},
    {"subtract", 2},
    {"multiply", 2},
    {"divide", 2},
    {"multiply_add", 3},
    {"multiply_subtract", 3},
    {"subtract_product", 3},
    {"negate", 1},
    {"power", 2},
    {"sqrt", 1},
    {"cbrt", 1},
    {"exp", 1},
    {"log", 1},
    {"sin", 1},
    {"cos", 1},
    {"tan", 1},
    {"sinh", 1},
    {"cosh", 1},
    {"tanh", 1},
    {"atan", 1},
    {"abs", 1},
    {"sign", 1},
};
static_assert(std::size(kOperations) == static_cast<std::size_t>(Operation::kSign) + 1);

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("program: " + what);
}

// The registers that have been set so far.
class SetRegisters {
 public:
  explicit SetRegisters(int count) {
    for (int k = 0; k < count; ++k) set_[k] = true;
  }

  std::uint8_t read(std::int32_t k) const {
    require(k >= 0 && k < kMaxRegisters && set_[k], "register " + std::to_string(k) + " is read but not set");
    return static_cast<std::uint8_t>(k);
  }

  std::uint8_t write(std::int32_t k) {
    require(k >= 0 && k < kMaxRegisters, "there is no register " + std::to_string(k));
    set_[k] = true;
    return static_cast<std::uint8_t>(k);
  }

 private:
  std::bitset<kMaxRegisters> set_;
};

}  // namespace

OwnedProgram::List OwnedProgram::checked(int parameter_count, const ListSource& source, int outputs) {
  const std::size_t count = source.operations.size(), known = std::size(kOperations);
  require(count <= kMaxOperations, "more than " + std::to_string(kMaxOperations) + " operations");
  require(source.registers.size() == 4 * count, "registers must have shape (operations, 4)");
  require(source.outputs.size() == static_cast<std::size_t>(outputs), "wrong number of outputs");
  const std::size_t given = kInvariantCount + static_cast<std::size_t>(parameter_count) + source.constants.size();
  require(given <= kMaxRegisters, "more than " + std::to_string(kMaxRegisters) + " registers");
  List list;
  SetRegisters registers(static_cast<int>(given));
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t code = source.operations[k];
    require(code >= 0 && static_cast<std::size_t>(code) < known, "operation " + std::to_string(code) + " is not known");
    std::uint8_t operand[3] = {0, 0, 0};
    for (int i = 0; i < kOperations[code].operands; ++i) operand[i] = registers.read(source.registers[4 * k + 1 + i]);
    const std::uint8_t target = registers.write(source.registers[4 * k]);
    list.instructions.push_back({static_cast<Operation>(code), target, operand[0], operand[1], operand[2]});
  }
  for (const double value : source.constants) {
    require(std::isfinite(value), "a constant is not finite");
    list.constants.push_back(value);
  }
  for (const std::int32_t output : source.outputs) list.outputs.push_back(registers.read(output));
  return list;
}

OwnedProgram::OwnedProgram(int parameter_count, const ListSource& energy, const ListSource& slopes,
                           const ListSource& derivatives) {
  require(parameter_count >= 0 && parameter_count <= kMaxRegisters, "wrong number of parameters");
  lists_ = {checked(parameter_count, energy, kEnergyOutputs), checked(parameter_count, slopes, kSlopeOutputs),
            checked(parameter_count, derivatives, kDerivativeOutputs)};
  const auto view = [](const List& list) -> InstructionList {
    const Instruction* begin = list.instructions.data();
    return {begin, begin + list.instructions.size(), list.constants.data(), static_cast<int>(list.constants.size()),
            list.outputs.data()};
  };
  view_ = {parameter_count, view(lists_[0]), view(lists_[1]), view(lists_[2])};
}

std::vector<std::pair<std::string, int>> program_operations() {
  std::vector<std::pair<std::string, int>> all;
  for (const OperationInfo& operation : kOperations) all.emplace_back(operation.name, operation.operands);
  return all;
}

}  // namespace qlb
