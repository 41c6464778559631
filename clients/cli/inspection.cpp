#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {

void AddInspectionVerbs(CLI::App&, Output&) {}

}  // namespace lambdajet::cli
