#include "trajectory/drawing/dxf_guard.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace lambdajet::trajectory {
namespace {

constexpr std::size_t kLongestLine = 2048;
constexpr std::size_t kLongestName = 255;
constexpr std::size_t kMostVertices = 32'000;  // the library counts them in 16 bits
constexpr std::size_t kMostNumbers =
    (std::size_t{1} << 24) - 16;  // places that single precision still tells apart
constexpr double kLargestNumber = 1e9;
constexpr int kExternal = 4 | 8;
constexpr int kSpatialPolyline = 8;

struct Group {
  int code = 0;
  std::string_view value;
  std::uint32_t line = 0;  // of the code
};

struct Entity {
  std::string_view type;
  std::uint32_t line = 0;
  std::vector<Group> groups;

  const Group* Find(int code) const {
    const auto at =
        std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.code == code; });
    return at == groups.end() ? nullptr : &*at;
  }
  std::string_view Text(int code) const {
    const Group* group = Find(code);
    return group == nullptr ? std::string_view() : group->value;
  }
};

// What the library is told of an entity: codes that must stand in the file, and codes written as 0 where they do not.
struct Keep {
  std::string_view type;
  std::vector<int> needed;
  std::vector<int> reals;  // in this order, missing ones as 0
  std::vector<int> counts;
};
const std::vector<Keep>& Kept() {
  static const std::vector<Keep> kKept = {
      {"LINE", {10, 20, 11, 21}, {10, 20, 30, 11, 21, 31}, {}},
      {"ARC", {10, 20, 40, 50, 51}, {10, 20, 30, 40, 50, 51, 210, 220}, {}},
      {"CIRCLE", {10, 20, 40}, {10, 20, 30, 40, 210, 220}, {}},
      {"ELLIPSE", {10, 20, 11, 21, 40}, {10, 20, 30, 11, 21, 31, 40, 210, 220}, {}},
      {"INSERT", {2, 10, 20}, {10, 20, 30, 50, 44, 45, 210, 220}, {}},
      {"BLOCK", {2}, {10, 20, 30}, {}},
      {"VERTEX", {10, 20}, {10, 20, 42}, {70}},
      {"LWPOLYLINE", {10, 20}, {210, 220}, {70}},
      {"POLYLINE", {}, {210, 220}, {70}},
      {"SPLINE", {10, 20, 40, 71}, {}, {70, 71}},
  };
  return kKept;
}
const Keep* KeepOf(std::string_view type) {
  for (const Keep& keep : Kept()) {
    if (keep.type == type) {
      return &keep;
    }
  }
  return nullptr;
}

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// Names of blocks and layers differ by more than case.
std::string NameOf(std::string_view text) {
  std::string name(text);
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return name;
}

class Guard {
 public:
  explicit Guard(std::string_view file) : rest_(file) { result_.numbers = {0.0, 1.0}; }

  GuardedDxf Run() {
    if (rest_.substr(0, 18) == "AutoCAD Binary DXF") {
      Refuse(1, "BINARY_DXF", "the file is a binary DXF; save it as ASCII DXF");
    } else if (rest_.size() > kLargestDxfBytes) {
      Refuse(1, "DXF_TOO_LARGE", "the file is larger than 64 MiB");
    } else if (rest_.substr(0, 3) == "\xEF\xBB\xBF") {
      rest_.remove_prefix(3);
    }
    while (!refused_ && !ended_ && Next()) {
      Section();
    }
    if (!refused_ && !ended_) {
      Refuse(line_, "TRUNCATED_FILE", "the file ends before 0 EOF");
    }
    if (refused_) {
      result_.text.clear();
    } else {
      Put(0, "EOF");
      TellReached("");
      TellLeftOut();
    }
    return std::move(result_);
  }

 private:
  // ---- findings ----

  void Refuse(std::uint32_t line, std::string_view reason, std::string message) {
    if (!refused_) {
      result_.findings.push_back({reason, true, "", "", line, {0, 0}, 0.0, std::move(message)});
    }
    refused_ = true;
  }
  // Of an entity: told where its block is inserted, or it stands in no block.
  void Tell(const Entity& e, std::string_view reason, std::string message, bool blocks = true) {
    const int x = e.Find(10) == nullptr ? 11 : 10;  // splines may have fit points only
    if (!block_.empty()) {
      message += " (in block " + Quoted(block_) + ", whose own X and Y these are)";
    }
    inside_[block_].findings.push_back({reason,
                                        blocks,
                                        std::string(e.Text(8).substr(0, kLongestName)),
                                        std::string(e.type.substr(0, 40)),
                                        e.line,
                                        {Peek(e, x), Peek(e, x + 10)},
                                        0.0,
                                        std::move(message),
                                        HandleOf(e)});
  }
  static std::string Quoted(std::string_view text) {
    return "'" + std::string(text.substr(0, 40)) + (text.size() > 40 ? "…'" : "'");
  }
  // 0: none, or none that is a number in hexadecimal digits.
  static std::uint64_t HandleOf(const Entity& e) {
    const std::string_view text = e.Text(5);
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
    return error == std::errc() && end == text.data() + text.size() ? number : 0;
  }
  static std::string MissingText(const Entity& e, int code) {
    return e.type == "SPLINE" && e.Find(11) != nullptr
               ? "the spline is drawn by fit points alone; save it with its control points, or as polyline"
               : "group code " + std::to_string(code) + " is missing";
  }
  static std::string UnknownText(const Entity& e) {
    if (e.type == "VERTEX") {
      return "VERTEX stands outside a POLYLINE";
    }
    const std::string type(e.type.substr(0, 40));
    return type + " is no contour; turn it into lines and arcs, or leave it out with --ignore-type " + type +
           " or its layer with --ignore";
  }
  void TellReached(const std::string& first) {
    std::vector<std::string> next = {first};
    std::set<std::string> reached = {first};
    while (!next.empty()) {
      const Inside inside = std::move(inside_[next.back()]);
      next.pop_back();
      result_.findings.insert(result_.findings.end(), inside.findings.begin(), inside.findings.end());
      for (const auto& [name, insertion] : inside.insertions) {
        if (references_.contains(name)) {
          result_.findings.push_back(insertion);
        }
        if (reached.insert(name).second) {
          next.push_back(name);
        }
      }
    }
  }
  void TellLeftOut() {
    if (invisible_ > 0) {
      result_.findings.push_back({"ENTITY_INVISIBLE",
                                  false,
                                  "",
                                  "",
                                  0,
                                  {0, 0},
                                  0.0,
                                  std::to_string(invisible_) + " invisible entities are left out"});
    }
    if (on_paper_ > 0) {
      result_.findings.push_back(
          {"PAPER_SPACE",
           false,
           "",
           "",
           0,
           {0, 0},
           0.0,
           std::to_string(on_paper_) + " entities of the paper space are left out; the model space is cut"});
    }
  }

  // ---- reading ----

  bool Line(std::string_view& line) {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = rest_.find('\n');
    line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++line_;
    if (line.size() > kLongestLine) {
      Refuse(line_, "LINE_TOO_LONG", "a line has more than 2048 characters");
      return false;
    }
    return true;
  }

  // The next pair, without comments (999); false at the end or after a refusal.
  bool Next() {
    do {
      std::string_view code, value;
      if (!Line(code)) {
        return false;
      }
      group_.line = line_;
      if (Trimmed(code).empty() && rest_.empty()) {
        return false;
      }
      if (!Integer(code, -5, 1071, group_.code)) {
        Refuse(line_, "BAD_GROUP_CODE", "a group code is a whole number from -5 to 1071");
        return false;
      }
      if (!Line(value)) {
        return false;
      }
      group_.value = Trimmed(value);
      if (std::any_of(group_.value.begin(), group_.value.end(),
                      [](char c) { return c >= 0 && c < ' ' && c != '\t'; })) {
        Refuse(line_, "BAD_STRUCTURE", "the file holds control characters; it is no ASCII DXF");
        return false;
      }
    } while (group_.code == 999);
    return true;
  }

  static bool Integer(std::string_view text, int low, int high, int& value) {
    text = Trimmed(text);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && value >= low && value <= high;
  }

  // ---- structure ----

  void Section() {
    if (group_.code != 0 || (group_.value != "SECTION" && group_.value != "EOF")) {
      Refuse(group_.line, "BAD_STRUCTURE", "a section (0 SECTION) or the end (0 EOF) must stand here");
      return;
    }
    ended_ = group_.value == "EOF";
    if (ended_ || !Next()) {
      return;
    }
    const std::string name(group_.value);
    if (group_.code != 2) {
      Refuse(group_.line, "BAD_STRUCTURE", "the name of the section (2) must stand here");
    } else if (name == "HEADER") {
      Header();
    } else if (name == "BLOCKS" || name == "ENTITIES") {
      if (!sections_.insert(name).second) {
        Refuse(group_.line, "BAD_STRUCTURE", "section " + name + " stands twice");
        return;
      }
      Put(0, "SECTION");
      Put(2, name);
      Entities(name == "BLOCKS");
      Put(0, "ENDSEC");
    } else if (name == "TABLES") {
      Layers();
    } else {
      Clips();
    }
  }

  // Layers that are switched off or frozen.
  void Layers() {
    std::string layer;
    bool of_layer = false;
    while (Next() && !(group_.code == 0 && group_.value == "ENDSEC")) {
      int number = 0;
      if (group_.code == 0) {
        of_layer = group_.value == "LAYER";
        layer.clear();
      } else if (of_layer && group_.code == 2) {
        layer = NameOf(group_.value);
      } else if (of_layer && group_.code == 70 && Integer(group_.value, -32768, 32767, number) &&
                 (number & 1) != 0) {
        result_.hidden_layers[layer] = HiddenLayer::kFrozen;
      } else if (of_layer && group_.code == 62 && Integer(group_.value, -32768, 32767, number) &&
                 number < 0) {
        result_.hidden_layers.emplace(layer, HiddenLayer::kOff);
      }
    }
  }

  // Of all other sections only what clips insertions matters, and only that it is there.
  void Clips() {
    bool filter = false;
    while (Next() && !(group_.code == 0 && group_.value == "ENDSEC")) {
      filter = group_.code == 0 ? group_.value == "SPATIAL_FILTER" : filter;
      if (filter && group_.code == 71 && group_.value == "1") {
        result_.findings.push_back(
            {"CLIPPED_INSERTION",
             true,
             "",
             "",
             group_.line,
             {0, 0},
             0.0,
             "the drawing clips an insertion (XCLIP), which is not followed; explode and "
             "trim it, and purge the drawing"});
        filter = false;
      }
    }
  }

  void Header() {
    std::string_view variable;
    while (Next() && !(group_.code == 0 && group_.value == "ENDSEC")) {
      variable = group_.code == 9 ? group_.value : variable;
      int units = 0;
      if (variable == "$INSUNITS" && group_.code == 70 && Integer(group_.value, 0, 32, units)) {
        Put(0, "SECTION");
        Put(2, "HEADER");
        Put(9, "$INSUNITS");
        Put(70, std::to_string(units));
        Put(0, "ENDSEC");
        variable = {};
      }
    }
  }

  // Up to ENDSEC; blocks hold entities up to ENDBLK.
  void Entities(bool in_blocks) {
    bool in_block = false;
    in_entities_ = !in_blocks;
    if (!Next()) {
      return;
    }
    while (!refused_ && !(group_.code == 0 && group_.value == "ENDSEC")) {
      Entity entity;
      if (!Collect(entity)) {
        return;
      }
      if (in_blocks && entity.type == "BLOCK" && !in_block) {
        in_block = true;
        Block(entity);
      } else if (in_blocks && entity.type == "ENDBLK" && in_block) {
        in_block = false;
        block_.clear();
        Put(0, "ENDBLK");
      } else if (in_block == in_blocks && entity.type != "BLOCK" && entity.type != "ENDBLK") {
        Write(entity);
      } else {
        Refuse(entity.line, "BAD_STRUCTURE",
               "BLOCK and ENDBLK must stand in pairs in the section BLOCKS, entities between them");
      }
    }
    if (in_block) {
      Refuse(line_, "BAD_STRUCTURE", "a block has no ENDBLK");
    }
  }

  // The entity that begins at the present group, up to the next code 0.
  bool Collect(Entity& entity) {
    if (group_.code != 0) {
      Refuse(group_.line, "BAD_STRUCTURE", "an entity (0) must stand here");
      return false;
    }
    entity.type = group_.value;
    entity.line = group_.line;
    bool dictionary = false;  // between 102 { and 102 }: an application's own
    while (Next()) {
      if (group_.code == 0) {
        return true;
      }
      dictionary ^= group_.code == 102;
      if (group_.code < 1000 && group_.code != 102 && !dictionary) {
        entity.groups.push_back(group_);
      }
    }
    if (!refused_) {
      Refuse(line_, "TRUNCATED_FILE", "the file ends within an entity");
    }
    return false;
  }

  void Block(const Entity& entity) {
    const std::string name = NameOf(entity.Text(2));
    if (!GoodName(name) || !blocks_.insert(name).second) {
      Refuse(entity.line, "DUPLICATE_BLOCK",
             GoodName(name) ? "block " + Quoted(name) + " stands twice"
                            : std::string("a block needs a name, of at most 255 characters"));
      return;
    }
    block_ = name;
    if ((CountOf(entity, 70, 0) & kExternal) != 0) {
      references_.insert(name);
    }
    Simple(entity, *KeepOf("BLOCK"));
  }

  // ---- writing ----

  void Put(int code, std::string_view value) {
    result_.text += std::to_string(code);
    result_.text += '\n';
    result_.text += value;
    result_.text += '\n';
  }
  void PutReal(int code, double value) {
    std::size_t place = value == 0.0 ? 0 : value == 1.0 ? 1 : result_.numbers.size();
    if (place > 1) {
      if (place >= kMostNumbers) {
        Refuse(line_, "DXF_TOO_LARGE", "the file holds more than 16 million numbers");
        return;
      }
      result_.numbers.push_back(value);
    }
    Put(code, std::to_string(place));
  }

  static bool Real(std::string_view text, double& value) {
    if (!text.empty() && text.front() == '+') {
      text.remove_prefix(1);
    }
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
  }
  double RealOf(const Group& group) {
    double value = 0.0;
    if (!Real(group.value, value)) {
      Refuse(group.line + 1, "BAD_NUMBER",
             Quoted(group.value) + " is no number; right is one like -12.5, at most 1e9");
    } else if (std::abs(value) > kLargestNumber) {
      Refuse(group.line + 1, "NUMBER_TOO_LARGE", "a number is at most 1e9");
    }
    return value;
  }
  static double Peek(const Entity& e, int code) {
    const Group* group = e.Find(code);
    double value = 0.0;
    return group != nullptr && Real(group->value, value) && std::abs(value) <= kLargestNumber ? value : 0.0;
  }
  int CountOf(const Entity& e, int code, int missing) {
    const Group* group = e.Find(code);
    int value = missing;
    if (group != nullptr && !Integer(group->value, -32768, 32767, value)) {
      Refuse(group->line + 1, "BAD_NUMBER",
             Quoted(group->value) + " is no whole number from -32768 to 32767");
    }
    return value;
  }
  static bool GoodName(std::string_view name) { return !name.empty() && name.size() <= kLongestName; }

  // What nobody sees on the drawing is not cut.
  bool LeftOut(const Entity& entity) {
    const bool paper = entity.Text(67) == "1", unseen = entity.Text(60) == "1";
    if (KeepOf(entity.type) != nullptr) {
      on_paper_ += paper ? 1 : 0;
      invisible_ += unseen && !paper ? 1 : 0;
    }
    // Entities of other kinds would be refused; on layer 0 of a block they stand on the insertion's layer.
    const bool hidden = KeepOf(entity.type) == nullptr &&
                        result_.hidden_layers.contains(NameOf(entity.Text(8).empty() ? "0" : entity.Text(8)));
    return paper || unseen || hidden;
  }

  void Write(const Entity& entity) {
    if (LeftOut(entity)) {
      return SkipFollowers(entity);
    }
    if (entity.type == "SEQEND" || entity.type == "ATTDEF" || entity.type == "VIEWPORT") {
      return;  // end of a list that was read, or a template of text, which never cuts
    }
    const Keep* keep = KeepOf(entity.type);
    if (keep == nullptr || entity.type == "VERTEX" || entity.type == "BLOCK") {
      Tell(entity, "UNKNOWN_ENTITY", UnknownText(entity));
      return;
    }
    for (const int code : keep->needed) {
      if (entity.Find(code) == nullptr) {
        Tell(entity, "MISSING_VALUE", MissingText(entity, code));
        return SkipFollowers(entity);
      }
    }
    if (entity.type == "INSERT") {
      Insertion(entity);
    }
    if (entity.type == "INSERT" && in_entities_ && !blocks_.contains(NameOf(entity.Text(2)))) {
      Tell(entity, "UNKNOWN_BLOCK", "no block " + Quoted(entity.Text(2)) + " stands before this insertion");
      return SkipFollowers(entity);
    }
    if (entity.type == "LWPOLYLINE") {
      LightPolyline(entity, *keep);
    } else if (entity.type == "SPLINE") {
      Spline(entity, *keep);
    } else if (entity.type == "POLYLINE") {
      Polyline(entity, *keep);
    } else {
      Simple(entity, *keep);
      SkipFollowers(entity);
    }
  }

  void Insertion(const Entity& entity) {
    inside_[block_].insertions.emplace(
        NameOf(entity.Text(2)),
        Finding{"EXTERNAL_REFERENCE",
                true,
                std::string(entity.Text(8).substr(0, kLongestName)),
                "INSERT",
                entity.line,
                {Peek(entity, 10), Peek(entity, 20)},
                0.0,
                "block " + Quoted(entity.Text(2)) +
                    " is another drawing, which this file does not hold; bind it, or send that drawing",
                HandleOf(entity)});
  }

  // Cut along the middle, which hides that the drawn width is lost.
  void TellWidth(const Entity& entity) {
    for (const Group& group : entity.groups) {
      double width = 0.0;
      if ((group.code == 40 || group.code == 41 || group.code == 43) && Real(group.value, width) &&
          width > 0.0) {
        return Tell(entity, "WIDE_POLYLINE", "is drawn with a width; its middle is cut", false);
      }
    }
  }

  void Open(const Entity& entity) {
    Put(0, entity.type);
    Common(entity);
  }
  void Common(const Entity& entity) {
    const std::string_view layer = entity.Text(8);
    Put(8, GoodName(layer) ? layer : "0");
    if (entity.type != "BLOCK") {
      PutReal(kLineCarrierCode, entity.line);
      if (const std::uint64_t handle = HandleOf(entity); handle != 0) {
        result_.handles.emplace_back(entity.line, handle);
      }
    }
  }
  void Reals(const Entity& entity, const Keep& keep) {
    for (const int code : keep.reals) {
      const Group* group = entity.Find(code);
      PutReal(code, group == nullptr ? 0.0 : RealOf(*group));
    }
    if (std::find(keep.reals.begin(), keep.reals.end(), 210) != keep.reals.end()) {
      const Group* group = entity.Find(230);
      PutReal(230, group == nullptr ? 1.0 : RealOf(*group));
    }
    for (const int code : keep.counts) {
      Put(code, std::to_string(CountOf(entity, code, code == 71 ? 3 : 0)));
    }
  }

  void Simple(const Entity& entity, const Keep& keep) {
    Open(entity);
    if (entity.type == "BLOCK" || entity.type == "INSERT") {
      const std::string name = NameOf(entity.Text(2));
      Put(2, GoodName(name) ? name : "?");
    }
    Reals(entity, keep);
    const auto optional = [&](int code, double missing) {
      const Group* group = entity.Find(code);
      PutReal(code, group == nullptr ? missing : RealOf(*group));
    };
    if (entity.type == "ELLIPSE") {
      optional(41, 0.0);
      optional(42, 2.0 * std::numbers::pi);
    } else if (entity.type == "INSERT") {
      optional(41, 1.0);
      optional(42, 1.0);
      Put(70, std::to_string(CountOf(entity, 70, 1)));
      Put(71, std::to_string(CountOf(entity, 71, 1)));
    }
  }

  void LightPolyline(const Entity& entity, const Keep& keep) {
    std::vector<std::array<double, 3>> vertices;
    for (const Group& group : entity.groups) {
      if (group.code == 10) {
        vertices.push_back({RealOf(group), 0.0, 0.0});
      } else if ((group.code == 20 || group.code == 42) && !vertices.empty()) {
        vertices.back()[group.code == 20 ? 1 : 2] = RealOf(group);
      }
    }
    if (vertices.size() > kMostVertices) {
      return Tell(entity, "TOO_MANY_VERTICES", "a polyline has at most 32000 vertices; split it");
    }
    TellWidth(entity);
    Put(0, "POLYLINE");
    Common(entity);
    PutReal(kLightCarrierCode, 1.0);
    Put(66, "1");
    Reals(entity, keep);
    for (const auto& [x, y, bulge] : vertices) {
      Put(0, "VERTEX");
      PutReal(10, x);
      PutReal(20, y);
      PutReal(42, bulge);
    }
    Put(0, "SEQEND");
  }

  void Spline(const Entity& entity, const Keep& keep) {
    std::vector<double> knots, weights;
    std::vector<std::array<double, 3>> points;
    for (const Group& group : entity.groups) {
      if (group.code == 40) {
        knots.push_back(RealOf(group));
      } else if (group.code == 41) {
        weights.push_back(RealOf(group));
      } else if (group.code == 10) {
        points.push_back({RealOf(group), 0.0, 0.0});
      } else if ((group.code == 20 || group.code == 30) && !points.empty()) {
        points.back()[group.code == 20 ? 1 : 2] = RealOf(group);
      }
    }
    if (std::max(knots.size(), points.size()) > kMostVertices) {
      return Tell(entity, "TOO_MANY_VERTICES", "a spline has at most 32000 knots and points; split it");
    }
    if (!weights.empty() && weights.size() != points.size()) {
      return Tell(entity, "MISSING_VALUE", "a rational spline needs a weight (41) for every control point");
    }
    Open(entity);
    Reals(entity, keep);
    Put(72, std::to_string(knots.size()));
    Put(73, std::to_string(points.size()));
    for (const double knot : knots) {
      PutReal(40, knot);
    }
    for (const double weight : weights) {
      PutReal(41, weight);
    }
    for (const auto& [x, y, z] : points) {
      PutReal(10, x);
      PutReal(20, y);
      PutReal(30, z);
    }
  }

  void Polyline(const Entity& entity, const Keep& keep) {
    const std::size_t before = result_.text.size();
    const bool spatial = (CountOf(entity, 70, 0) & kSpatialPolyline) != 0;
    double lowest = kLargestNumber, highest = -kLargestNumber;
    TellWidth(entity);
    Open(entity);
    Put(66, "1");
    Reals(entity, keep);
    std::size_t count = 0;
    while (!refused_ && group_.code == 0 && group_.value == "VERTEX") {
      Entity vertex;
      if (!Collect(vertex)) {
        return;
      }
      if (vertex.Find(10) == nullptr || vertex.Find(20) == nullptr || ++count > kMostVertices) {
        Refuse(vertex.line, count > kMostVertices ? "TOO_MANY_VERTICES" : "MISSING_VALUE",
               count > kMostVertices ? "a polyline has at most 32000 vertices; split it"
                                     : "a vertex needs the group codes 10 and 20");
        return;
      }
      lowest = std::min(lowest, Peek(vertex, 30));
      highest = std::max(highest, Peek(vertex, 30));
      Put(0, "VERTEX");
      Put(8, "0");
      Reals(vertex, *KeepOf("VERTEX"));
    }
    Put(0, "SEQEND");
    if (spatial && highest - lowest > kFlat) {
      result_.text.resize(before);
      Tell(entity, "ENTITY_NOT_IN_PLANE", "the entity climbs; its Z must not change");
    }
    if (!refused_ && !(group_.code == 0 && group_.value == "SEQEND")) {
      Refuse(group_.line, "BAD_STRUCTURE", "a polyline's vertices end with SEQEND");
    }
  }

  // Vertices or attributes of an entity that is left out, and attributes of an insertion, which are text.
  void SkipFollowers(const Entity& entity) {
    if (entity.type != "POLYLINE" && entity.type != "INSERT") {
      return;
    }
    while (!refused_ && group_.code == 0 && (group_.value == "VERTEX" || group_.value == "ATTRIB")) {
      Entity follower;
      if (!Collect(follower)) {
        return;
      }
    }
  }

  std::string_view rest_;
  std::uint32_t line_ = 0;
  Group group_;
  bool refused_ = false;
  bool ended_ = false;
  bool in_entities_ = false;
  struct Inside {
    std::vector<Finding> findings;
    std::map<std::string, Finding> insertions;  // by block: what is told where that is no block of this file
  };

  std::set<std::string> sections_;
  std::set<std::string> blocks_;
  std::set<std::string> references_;  // blocks that are other drawings
  std::map<std::string, Inside> inside_;
  std::string block_;  // empty: in none
  std::size_t invisible_ = 0, on_paper_ = 0;
  GuardedDxf result_;
};

}  // namespace

GuardedDxf GuardDxf(std::string_view file) { return Guard(file).Run(); }

}  // namespace lambdajet::trajectory
