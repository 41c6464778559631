#include "kinematics/core/lambda_block.hpp"

namespace lambdajet::kinematics::lambda {

BlockSolvers TwoLaneSolvers() { return {2, block::Inverse<2>, block::Forward<2>}; }

}  // namespace lambdajet::kinematics::lambda
