#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {

void AddAccuracyVerbs(CLI::App&, Output&) {}

}  // namespace lambdajet::cli
