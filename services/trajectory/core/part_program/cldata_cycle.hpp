// Reads what a CYCLE statement of CLDATA says about the holes that follow; the CLDATA reader's own, not for others.
//
// Model: CYCLE as Creo, NX, Fusion and ICAM's posts write it. Every GOTO under it names the place where the tool enters the part;
// heights count from there along the tool's axis. DRILL and FACE drill in one go, DEEP and PECK come out to the height where
// feeding begins after each STEP, BRKCHP goes back a little; the last three may stand behind DRILL, too. CLEAR is where the
// tool moves between holes, RAPTO how far it goes on from there in rapid (Creo, Fusion); without CLEAR, and with FEDTO, RAPTO is
// the height where feeding begins (NX). Numbers without a word are the depth, first, and CLEAR, behind the feed. A feed stands
// behind its unit.
// Units: as UNITS says in, mm and s out. Threads: pure. Errors: the first fault.
#pragma once

#include "trajectory/core/part_program/cldata_words.hpp"
#include "trajectory/core/spatial_feed/drilling_cycle.hpp"

namespace lambdajet::trajectory {

struct CldataCycle {
  HoleHeights heights;
  double dwell_s = 0.0;
  double feed_mm_per_s = 0.0;  // 0: the program's
};

// What else the numbers depend on.
struct CldataUnits {
  double unit_mm = 1.0;
  double spindle_per_min = 0.0;  // 0: not known
};

// False if it is not one of the words for a feed.
bool IsFeedUnit(std::string_view word);

// False, with a fault at the unit, if a feed a turn has no spindle's speed.
bool FeedIn(const CldataParameter& unit, double value, const CldataUnits& units, double& feed_mm_per_s,
            CldataFault& fault);

// A statement with a type, not ON or OFF. False after a fault.
bool ReadCycle(const CldataStatement& statement, const CldataUnits& units, CldataCycle& cycle,
               CldataFault& fault);

}  // namespace lambdajet::trajectory
