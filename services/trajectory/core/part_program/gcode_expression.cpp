#include "trajectory/core/part_program/gcode_expression.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace lambdajet::trajectory {
namespace {

constexpr int kDeepest = 64;
constexpr double kEqual = 1e-6;  // LinuxCNC's TOLERANCE_EQUAL
constexpr double kWhole = 1e-4;  // what may be taken for an integer
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::size_t kLongestName = 200;

enum class Function {
  kAbs,
  kAcos,
  kAsin,
  kAtan,
  kCos,
  kExists,
  kExp,
  kFix,
  kFup,
  kLn,
  kRound,
  kSin,
  kSqrt,
  kTan
};
struct FunctionName {
  std::string_view name;
  Function function;
};
constexpr std::array<FunctionName, 14> kFunctions = {{{"ABS", Function::kAbs},
                                                      {"ACOS", Function::kAcos},
                                                      {"ASIN", Function::kAsin},
                                                      {"ATAN", Function::kAtan},
                                                      {"COS", Function::kCos},
                                                      {"EXISTS", Function::kExists},
                                                      {"EXP", Function::kExp},
                                                      {"FIX", Function::kFix},
                                                      {"FUP", Function::kFup},
                                                      {"LN", Function::kLn},
                                                      {"ROUND", Function::kRound},
                                                      {"SIN", Function::kSin},
                                                      {"SQRT", Function::kSqrt},
                                                      {"TAN", Function::kTan}}};

enum class Operator {
  kPower,
  kTimes,
  kDivided,
  kModulo,
  kPlus,
  kMinus,
  kEq,
  kNe,
  kGt,
  kGe,
  kLt,
  kLe,
  kAnd,
  kOr,
  kXor
};
struct OperatorName {
  std::string_view name;
  Operator op;
  int rank;  // binds tighter the higher
};
constexpr std::array<OperatorName, 15> kOperators = {{{"**", Operator::kPower, 5},
                                                      {"*", Operator::kTimes, 4},
                                                      {"/", Operator::kDivided, 4},
                                                      {"MOD", Operator::kModulo, 4},
                                                      {"+", Operator::kPlus, 3},
                                                      {"-", Operator::kMinus, 3},
                                                      {"EQ", Operator::kEq, 2},
                                                      {"NE", Operator::kNe, 2},
                                                      {"GT", Operator::kGt, 2},
                                                      {"GE", Operator::kGe, 2},
                                                      {"LT", Operator::kLt, 2},
                                                      {"LE", Operator::kLe, 2},
                                                      {"AND", Operator::kAnd, 1},
                                                      {"OR", Operator::kOr, 1},
                                                      {"XOR", Operator::kXor, 1}}};

class ExpressionReader {
 public:
  ExpressionReader(LineScan& scan, const Parameters& parameters) : scan_(scan), parameters_(parameters) {}

  bool Value(std::size_t word, double& value) {
    const std::size_t from = scan_.at();
    switch (const char c = scan_.Next()) {
      case '[':
        return Bracket(value);
      case '#':
        return Parameter(value);
      case '+':
      case '-':
        return Signed(word, c == '-', value);
      default:
        if (IsLetter(c)) {
          return Call(word, value);
        }
        return scan_.Number(value, word) || FailNumber(word, from);
    }
  }

  bool Bracket(double& value) {
    const std::size_t from = scan_.at();
    scan_.Step();
    if (++depth_ > kDeepest) {
      return scan_.Fail("EXPRESSION_TOO_DEEP", from, "square brackets stand at most 64 deep");
    }
    if (!Operand(value) || !Chain(from, 1, value)) {
      return false;
    }
    --depth_;
    return std::isfinite(value) ||
           scan_.Fail("EXPRESSION_NOT_FINITE", from, "the value is too large for a number");
  }

  // "#…" without its value: the index, or the name if it is not empty.
  bool Place(int& index, std::string& name) {
    const std::size_t from = scan_.at();
    scan_.Step();
    if (scan_.Next() == '<') {
      return ReadName(scan_, name);
    }
    double number = 0.0;
    if (++depth_ > kDeepest) {
      return scan_.Fail("EXPRESSION_TOO_DEEP", from, "parameters stand for parameters at most 64 deep");
    }
    if (!Value(from, number)) {
      return false;
    }
    --depth_;
    if (!(std::abs(number - std::round(number)) <= kWhole)) {
      return scan_.Fail("PARAMETER_NOT_WHOLE", from, "the number of a parameter is a whole number");
    }
    if (!(number > 0.5 && number < kLastParameter + 0.5)) {
      return scan_.Fail("PARAMETER_OUT_OF_RANGE", from, "parameters are numbered 1 … 5601");
    }
    index = static_cast<int>(std::round(number));
    return true;
  }

 private:
  bool FailNumber(std::size_t word, std::size_t from) {
    scan_.GoTo(from);
    return scan_.Fail("BAD_NUMBER", word, "a number was expected here");
  }

  bool Signed(std::size_t word, bool minus, double& value) {
    const std::size_t from = scan_.at();
    if (scan_.Number(value, word)) {
      return true;
    }
    if (scan_.failed()) {
      return false;
    }
    scan_.Step();
    const char c = scan_.Next();
    if (c != '[' && c != '#' && !IsLetter(c)) {
      return FailNumber(word, from);
    }
    if (!Value(word, value)) {
      return false;
    }
    value = minus ? -value : value;
    return true;
  }

  bool Parameter(double& value) {
    const std::size_t from = scan_.at();
    int index = 0;
    std::string name;
    if (!Place(index, name)) {
      return false;
    }
    if (name.empty()) {
      if (parameters_.Unknowable(index)) {
        return scan_.Fail(
            "INPUT_RESULT_UNKNOWN", from,
            "what M66 sees is known when the machine runs, and a program is planned whole before; the "
            "machine holds by itself where the wait fails");
      }
      value = parameters_.Numbered(index);
      return true;
    }
    const std::optional<double> named = parameters_.Named(name);
    if (!named) {
      return scan_.Fail("PARAMETER_UNDEFINED", from,
                        "a named parameter must be set before; names without _ belong to their subroutine");
    }
    value = *named;
    return true;
  }

  bool Call(std::size_t word, double& value) {
    const std::size_t from = scan_.at();
    for (const FunctionName& f : kFunctions) {
      if (!scan_.Take(f.name)) {
        continue;
      }
      if (scan_.Next() != '[') {
        return scan_.Fail("FUNCTION_BRACKET_MISSING", from, "a function is followed by [ ]");
      }
      if (f.function == Function::kExists) {
        return Exists(from, value);
      }
      return Bracket(value) && Apply(f.function, from, value);
    }
    return FailNumber(word, from);
  }

  bool Exists(std::size_t from, double& value) {
    scan_.Step();
    std::string name;
    if (scan_.Next() == '#') {
      scan_.Step();
      if (scan_.Next() == '<' && !ReadName(scan_, name)) {
        return false;
      }
    }
    if (name.empty() || scan_.Next() != ']') {
      return scan_.Fail("EXISTS_ARGUMENT", from, "EXISTS takes one named parameter, as in EXISTS[#<name>]");
    }
    scan_.Step();
    value = parameters_.Named(name) ? 1.0 : 0.0;
    return true;
  }

  bool Apply(Function function, std::size_t from, double& value) {
    switch (function) {
      case Function::kAbs:
        value = std::abs(value);
        return true;
      case Function::kAcos:
      case Function::kAsin:
        if (!(value >= -1.0 && value <= 1.0)) {
          return scan_.Fail("FUNCTION_ARGUMENT", from, "ACOS and ASIN take -1 … 1");
        }
        value = (function == Function::kAcos ? std::acos(value) : std::asin(value)) / kDegree;
        return true;
      case Function::kAtan:
        return Atan(from, value);
      case Function::kLn:
        if (!(value > 0.0)) {
          return scan_.Fail("FUNCTION_ARGUMENT", from, "LN takes a number above 0");
        }
        value = std::log(value);
        return true;
      case Function::kSqrt:
        if (!(value >= 0.0)) {
          return scan_.Fail("FUNCTION_ARGUMENT", from, "SQRT takes a number from 0");
        }
        value = std::sqrt(value);
        return true;
      default:
        return ApplySmooth(function, from, value);
    }
  }

  bool ApplySmooth(Function function, std::size_t from, double& value) {
    switch (function) {
      case Function::kCos:
        value = std::cos(value * kDegree);
        break;
      case Function::kSin:
        value = std::sin(value * kDegree);
        break;
      case Function::kTan:
        value = std::tan(value * kDegree);
        break;
      case Function::kExp:
        value = std::exp(value);
        break;
      case Function::kFix:
        value = std::floor(value);
        break;
      case Function::kFup:
        value = std::ceil(value);
        break;
      default:
        value = std::round(value);
        break;
    }
    return std::isfinite(value) ||
           scan_.Fail("EXPRESSION_NOT_FINITE", from, "the value is too large for a number");
  }

  bool Atan(std::size_t from, double& value) {
    if (scan_.Next() != '/') {
      return scan_.Fail("FUNCTION_ARGUMENT", from, "ATAN takes two numbers, as in ATAN[y]/[x]");
    }
    scan_.Step();
    double x = 0.0;
    if (scan_.Next() != '[') {
      return scan_.Fail("FUNCTION_ARGUMENT", from, "ATAN takes two numbers, as in ATAN[y]/[x]");
    }
    if (!Bracket(x)) {
      return false;
    }
    value = std::atan2(value, x) / kDegree;
    return true;
  }

  bool Operand(double& value) {
    const char c = scan_.Next();
    if (c == '\0' || c == ']') {
      return scan_.Fail("OPERAND_MISSING", scan_.at(), "a value was expected here");
    }
    return Value(scan_.at(), value);
  }

  // Operators of `rank` and above, up to the closing bracket at rank 1. `from` is the opening bracket.
  bool Chain(std::size_t from, int rank, double& value) {
    for (;;) {
      const std::size_t before = scan_.at();
      if (scan_.Next() == ']') {
        if (rank == 1) {
          scan_.Step();
        }
        return true;
      }
      const std::size_t at = scan_.at();
      const OperatorName* op = NextOperator(from);
      if (op == nullptr) {
        return false;
      }
      if (op->rank < rank) {
        scan_.GoTo(before);
        return true;
      }
      double right = 0.0;
      if (!Operand(right) || (op->rank < 5 && !Chain(from, op->rank + 1, right)) ||
          !Combine(op->op, at, value, right)) {
        return false;
      }
    }
  }

  const OperatorName* NextOperator(std::size_t from) {
    if (scan_.AtEnd() || scan_.Next() == '\0' || scan_.Next() == ';') {
      scan_.GoTo(scan_.line().size());
      scan_.Fail("EXPRESSION_NOT_CLOSED", from, "a square bracket is closed in its own line");
      return nullptr;
    }
    for (const OperatorName& op : kOperators) {
      if (scan_.Take(op.name)) {
        return &op;
      }
    }
    scan_.Fail("OPERATOR_UNKNOWN", scan_.at(), "an operator or ] was expected here");
    return nullptr;
  }

  bool Combine(Operator op, std::size_t at, double& left, double right) {
    switch (op) {
      case Operator::kPower:
        if (left < 0.0 && std::floor(right) != right) {
          return scan_.Fail("POWER_OF_NEGATIVE", at, "a negative number has whole powers only");
        }
        left = std::pow(left, right);
        break;
      case Operator::kTimes:
        left *= right;
        break;
      case Operator::kDivided:
      case Operator::kModulo:
        if (right == 0.0) {
          return scan_.Fail("DIVISION_BY_ZERO", at, "the divisor is 0");
        }
        left = op == Operator::kDivided ? left / right : Modulo(left, right);
        break;
      case Operator::kPlus:
        left += right;
        break;
      case Operator::kMinus:
        left -= right;
        break;
      default:
        left = Holds(op, left, right) ? 1.0 : 0.0;
    }
    return std::isfinite(left) ||
           scan_.Fail("EXPRESSION_NOT_FINITE", at, "the value is too large for a number");
  }

  static double Modulo(double left, double right) {
    const double rest = std::fmod(left, right);
    return rest < 0.0 ? rest + std::abs(right) : rest;
  }

  static bool Equal(double left, double right) { return std::abs(left - right) < kEqual; }

  static bool Holds(Operator op, double left, double right) {
    switch (op) {
      case Operator::kEq:
        return Equal(left, right);
      case Operator::kNe:
        return !Equal(left, right);
      case Operator::kGt:
        return left > right;
      case Operator::kGe:
        return left >= right || Equal(left, right);
      case Operator::kLt:
        return left < right;
      case Operator::kLe:
        return left <= right || Equal(left, right);
      case Operator::kAnd:
        return left != 0.0 && right != 0.0;
      case Operator::kOr:
        return left != 0.0 || right != 0.0;
      default:
        return (left != 0.0) != (right != 0.0);
    }
  }

  LineScan& scan_;
  const Parameters& parameters_;
  int depth_ = 0;
};

// What the state alone may change.
bool ReadOnly(int index) {
  return (index >= 5021 && index <= 5029) || (index >= 5081 && index <= 5089) || index == 5210 ||
         index == 5220 || (index >= 5400 && index <= 5413) || (index >= 5420 && index <= 5428);
}

}  // namespace

bool ReadValue(LineScan& scan, const Parameters& parameters, std::size_t word, double& value) {
  return ExpressionReader(scan, parameters).Value(word, value);
}

bool ReadExpression(LineScan& scan, const Parameters& parameters, double& value) {
  if (scan.Next() != '[') {
    return scan.Fail("EXPRESSION_MISSING", scan.at(), "an expression in [ ] was expected here");
  }
  return ExpressionReader(scan, parameters).Bracket(value);
}

bool ReadName(LineScan& scan, std::string& name) {
  const std::size_t from = scan.at();
  for (scan.Step(); !scan.AtEnd(); scan.Step()) {
    const char c = scan.line()[scan.at()];
    if (c == '>') {
      scan.Step();
      return !name.empty() || scan.Fail("NAME_EMPTY", from, "a name has at least one character");
    }
    if (c == '<' || static_cast<unsigned char>(c) < ' ' || name.size() == kLongestName) {
      if (!IsSpace(c)) {
        break;
      }
    } else if (!IsSpace(c)) {
      name += static_cast<unsigned char>(c - 'A') < 26 ? static_cast<char>(c + 32) : c;
    }
  }
  return scan.Fail("NAME_NOT_CLOSED", from, "a name ends with > and has at most 200 characters");
}

bool ReadSetting(LineScan& scan, Parameters& parameters) {
  const std::size_t from = scan.at();
  int index = 0;
  std::string name;
  if (!ExpressionReader(scan, parameters).Place(index, name)) {
    return false;
  }
  if (scan.Next() != '=') {
    return scan.Fail("PARAMETER_WITHOUT_USE", from, "a parameter stands after a letter or before = here");
  }
  if (name.empty() ? ReadOnly(index) : (name.front() == '_' && parameters.ReadOnly(name))) {
    return scan.Fail("PARAMETER_READ_ONLY", from, "this parameter tells the state, it cannot be set");
  }
  scan.Step();
  double value = 0.0;
  if (!ReadValue(scan, parameters, from, value)) {
    return false;
  }
  if (name.empty()) {
    parameters.Defer(index, value);
  } else {
    parameters.Defer(std::move(name), value);
  }
  return true;
}

}  // namespace lambdajet::trajectory
