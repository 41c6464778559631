// Tells causes from consequences: what of a reader's state is in doubt behind a line at fault; the reader's own, not for others.
//
// Model: every judgement rests on parts of the modal state. A line at fault is taken to mean what its words say, so that
// place, modes and switches behind it are known again; what they do not say stays in doubt until a word settles it. A fault
// that rests on something in doubt is not told: it may only follow from one that was.
// Threads: none of its own.
#pragma once

#include <cstdint>
#include <string_view>

namespace lambdajet::trajectory {

class Reading;

using Doubt = std::uint32_t;
inline constexpr Doubt kPlaceDoubt = 0x3f;  // a bit each of X Y Z A B C
inline constexpr Doubt kMotionDoubt = 1u << 6;
inline constexpr Doubt kFeedDoubt = 1u << 7;
inline constexpr Doubt kJetDoubt = 1u << 8;
inline constexpr Doubt kKerfDoubt = 1u << 9;
inline constexpr Doubt kPlaneDoubt = 1u << 10;
inline constexpr Doubt kUnitsDoubt = 1u << 11;
inline constexpr Doubt kDistanceDoubt = 1u << 12;
inline constexpr Doubt kToolDoubt = 1u << 13;
inline constexpr Doubt kSpeedDoubt = 1u << 14;
inline constexpr Doubt kCycleDoubt = 1u << 15;
inline constexpr Doubt kSplineDoubt = 1u << 16;
inline constexpr Doubt kEndDoubt = 1u << 17;  // whether the program has ended
inline constexpr Doubt kEveryDoubt = (1u << 17) - 1;

// Of the state that a fault of this reason is judged by.
Doubt RestsOn(std::string_view reason);
// Of the state behind a line with such a fault, whatever its words say.
Doubt LeavesInDoubt(std::string_view reason);

// Modes that the words of this block set are not in doubt while it is judged, nor its switches behind it.
void SettleModes(Reading& r);
void SettleSwitches(Reading& r);
// Takes the line that was not obeyed at its words. Words behind a fault of writing are known by their letters only.
void TakeAtItsWords(Reading& r, bool whole_line_read);

}  // namespace lambdajet::trajectory
