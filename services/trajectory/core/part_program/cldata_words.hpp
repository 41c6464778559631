// Splits a CLDATA file into statements: a major word and its parameters, each with the line and column it stands at; the
// reader's own, not for others.
//
// Model: APT as CAM posts write it (ISO 4343 words): WORD/PARAMETER,PARAMETER,…; "$$" begins a comment, "$" at a line's end
// goes on in the next line (what follows it counts as a comment), spaces and small letters do not count, text may stand in
// single quotes; PARTNO, PPRINT and their like take the rest of their line as it is.
// Threads: values. Cost: one look at each character. Errors: the first fault of a statement; reading goes on at the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lambdajet::trajectory {

inline constexpr std::size_t kMostParameters = 64;

// A place in the file and what stands there.
struct CldataPlace {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::string_view text;
};

struct CldataParameter {
  CldataPlace place;
  bool is_number = false;
  double value = 0.0;
  std::string word;  // upper case without spaces; empty for a number
};

struct CldataStatement {
  CldataPlace place;  // of the major word
  std::string major;  // upper case without spaces
  std::vector<CldataParameter> parameters;
};

struct CldataFault {
  const char* reason = nullptr;
  CldataPlace place;
  const char* message = "";
};

class CldataLines {
 public:
  explicit CldataLines(std::string_view text) : text_(text) {}

  // False at the end of the file. Where `fault` has a reason the statement is not to be used.
  bool Next(CldataStatement& statement, CldataFault& fault);
  std::uint32_t line_count() const { return line_number_; }

 private:
  bool NextLine();
  void SkipComment(std::size_t first);
  bool Continued(std::size_t comment) const;
  void SkipContinued();
  void Scan(CldataStatement& statement, CldataFault& fault);
  bool Parameters(CldataStatement& statement, CldataFault& fault, std::size_t at);
  bool Parameter(CldataStatement& statement, CldataFault& fault, std::size_t from, std::size_t to);
  bool Refuse(CldataFault& fault, std::size_t from, std::size_t to, const char* reason,
              const char* message) const;
  CldataPlace PlaceOf(std::size_t from, std::size_t to) const;

  std::string_view text_;
  std::size_t at_ = 0;
  std::uint32_t line_number_ = 0;
  std::string_view line_;   // without comment, line end and continuation mark
  bool continues_ = false;  // its continuation mark
};

}  // namespace lambdajet::trajectory
