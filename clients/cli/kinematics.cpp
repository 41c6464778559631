#include "clients/cli/verbs.hpp"

namespace lambdajet::cli {

void AddKinematicsVerbs(CLI::App&, Output&) {}

}  // namespace lambdajet::cli
