#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {

void AddTrajectoryVerbs(CLI::App&, Output&) {}

}  // namespace lambdajet::cli
