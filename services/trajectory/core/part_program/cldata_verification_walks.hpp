// Walks through a part program for its verification, over path length and over the turn of the workpiece; the verifier's own,
// not for others.
//
// Model: see cldata_verification.hpp. Units: mm and rad. Threads: pure.
#pragma once

#include "trajectory/core/part_program/cldata_verification.hpp"

namespace lambdajet::trajectory {

inline bool Cuts(const Operation& o) {
  return o.kind == OperationKind::kFeedLine || o.kind == OperationKind::kFeedArc;
}
inline bool Moves(const Operation& o) { return Cuts(o) || o.kind == OperationKind::kTraverse; }

// Fills series, pieces and breaks from exact lines and arcs (cldata_verification_path.cpp).
void WalkPath(const std::vector<Operation>& operations, ProgramVerification& result);

// Fills them from points of X, Z and A over C (cldata_verification_turn.cpp).
void WalkTurn(const std::vector<Operation>& operations, ProgramVerification& result);

// Derivatives and breaks of one coordinate's points [from, to), one piece (cldata_verification_samples.cpp).
void SearchPiece(ProgramVerification& result, std::size_t coordinate, std::size_t from, std::size_t to);

}  // namespace lambdajet::trajectory
