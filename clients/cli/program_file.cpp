#include "clients/cli/program_file.hpp"

#include <algorithm>
#include <string_view>

#include "clients/cli/text_file.hpp"
#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

// A DXF file is pairs of lines, a group code and a value; after comments (999) the first pair is 0, SECTION.
bool LooksLikeDxf(std::string_view text) {
  const auto next_word = [&text] {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    line.remove_prefix(std::min(first, line.size()));
    return line.substr(0, line.find_last_not_of(" \t\r") + 1);
  };
  std::string_view code = next_word();
  while (code == "999" && !text.empty()) {
    next_word();
    code = next_word();
  }
  return code == "0" && next_word() == "SECTION";
}

}  // namespace

absl::StatusOr<std::string> ReadProgramFile(const std::string& path) {
  auto text = ReadTextFile(path);
  if (text.ok() && LooksLikeDxf(*text)) {
    return Trouble(absl::StatusCode::kInvalidArgument, "DRAWING_NOT_PROGRAM",
                   path + " is a DXF drawing; `lambdajet trajectory toolpath " + path +
                       " --out part.ngc` makes a part program of it");
  }
  return text;
}

void AddAxesOption(CLI::App& verb, std::string& axes) {
  verb.add_option(
          "--axes", axes,
          "of the machine the program is read for: xy, rotary-head (also Z and a tilting tool) or hexapod "
          "(the same, A and B its roll and pitch)")
      ->check(CLI::IsMember({"xy", "rotary-head", "hexapod"}))
      ->capture_default_str();
}

std::uint8_t AxesOf(const std::string& axes) {
  return axes == "xy" ? trajectory::kPlanarAxes : trajectory::kSixAxes;
}

trajectory::ToolAngles ToolAnglesOf(const std::string& axes) {
  return axes == "hexapod" ? trajectory::ToolAngles::kRollPitch : trajectory::ToolAngles::kRotaryHead;
}

}  // namespace lambdajet::cli
