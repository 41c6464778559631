#include "kinematics/core/lambda_block.hpp"

namespace lambdajet::kinematics::lambda {

BlockSolvers FourLaneSolvers() { return {4, block::Inverse<4>, block::Forward<4>}; }

}  // namespace lambdajet::kinematics::lambda
