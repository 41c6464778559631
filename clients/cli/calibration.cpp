#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {

void AddCalibrationVerbs(CLI::App&, Output&) {}

}  // namespace lambdajet::cli
