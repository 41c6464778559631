#include "kinematics/core/lambda_block.hpp"

namespace lambdajet::kinematics::lambda {

BlockSolvers EightLaneSolvers() { return {8, block::Inverse<8>, block::Forward<8>}; }

}  // namespace lambdajet::kinematics::lambda
