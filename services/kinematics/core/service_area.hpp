// Computes the area that a machine with a tilted drill serves from both sides, as the paper does and as it
// really is.
//
// Model: seed paper 002. Two struts of length l to L hang on joints (0, 0) and (a, 0), y down to the table;
// they carry a platform of joint spacing b with the tool, H long, square to its middle, tilted by +phi and by
// -phi. For a tool tip T strut i gives l <= |T - c_i| <= L with c1 = b/2 u + H n, c2 = (a, 0) - b/2 u + H n,
// u = (cos, +-sin), n = (-+sin, cos). The frame is a trapezoid, 1.1 a wide at the top and 1.3 a at the table.
//   Paper: closed form (1)-(30), its misprints corrected. Its region lies inside both outer arcs but outside
//   only one inner arc (the other tilt's), so it is neither what both tilts reach nor what one of them does,
//   and its growth with tilt is an artefact. The decomposition presumes x_B <= x_A <= x_E <= x_D and is
//   evaluated as it stands where that fails. Exact: areas between all curves' crossings, piece by piece in
//   closed form. Tool tips above a joint centre's image are left out, since there the platform would stand
//   above its base.
// Frames: origin in base joint 1 for everything exact; the closed form's points (x_E …) are from c1 of +phi,
// as printed. Units: mm, mm^2, rad. Validity: see FaultOf. Threads: any. Cost: closed form about 1 us, exact
// some 20 us; no allocation.
#pragma once

#include <array>
#include <string_view>

namespace lambdajet::kinematics {

struct ServiceAreaMachine {
  double base_joint_spacing_mm = 1350.0;     // a
  double platform_joint_spacing_mm = 500.0;  // b
  double strut_min_mm = 500.0;               // l
  double strut_max_mm = 1350.0;              // L
  double tool_length_mm = 100.0;             // H
  double tilt_rad = 0.0;                     // phi, 0 to below 90 deg
  double height_mm = 1200.0;                 // H_BPK, base to table
  double frame_top_ratio = 1.1;              // D_BP / a
  double frame_bottom_ratio = 1.3;           // D_HP / a
};
std::string_view FaultOf(const ServiceAreaMachine& machine);

// Its numbers by name, for doors and files.
using ServiceMember = double ServiceAreaMachine::*;
struct ServiceNumber {
  std::string_view name;
  ServiceMember member;
};
inline constexpr std::array<ServiceNumber, 9> kServiceNumbers = {
    {{"base_joint_spacing_mm", &ServiceAreaMachine::base_joint_spacing_mm},
     {"platform_joint_spacing_mm", &ServiceAreaMachine::platform_joint_spacing_mm},
     {"strut_min_mm", &ServiceAreaMachine::strut_min_mm},
     {"strut_max_mm", &ServiceAreaMachine::strut_max_mm},
     {"tool_length_mm", &ServiceAreaMachine::tool_length_mm},
     {"tilt_rad", &ServiceAreaMachine::tilt_rad},
     {"height_mm", &ServiceAreaMachine::height_mm},
     {"frame_top_ratio", &ServiceAreaMachine::frame_top_ratio},
     {"frame_bottom_ratio", &ServiceAreaMachine::frame_bottom_ratio}}};

// All intermediate values of the closed form, left half.
struct PaperServiceArea {
  bool defined = false;  // false where a curve does not meet the one it should, and nothing below holds
  double c1_mm = 0.0, c2 = 0.0;  // radical line of the outer circles, y = c1 + c2 x
  double x_E_mm = 0.0;
  double x_M_mm = 0.0, y_M_mm = 0.0;
  double k = 0.0;
  double x_A_mm = 0.0, x_B_mm = 0.0, x_K_mm = 0.0;
  double x_D_mm = 0.0, y_D_mm = 0.0;
  double s1_mm2 = 0.0, s2_mm2 = 0.0, s3_mm2 = 0.0, s4_mm2 = 0.0;
  double area_mm2 = 0.0;
  bool in_order = false;  // x_B <= x_A <= x_E <= x_D: the decomposition is the region
};
PaperServiceArea PaperClosedForm(const ServiceAreaMachine& machine);
// Equation (30) with every misprint. Not defined at phi = 0.
PaperServiceArea PaperAsPrinted(const ServiceAreaMachine& machine);

enum class ServiceRegion {
  kPaper,         // the region that the closed form is about
  kIntersection,  // served at +phi and at -phi: what two-sided drilling needs
  kUnion,         // served at +phi or at -phi
  kSingleTilt,    // served at +phi
};
std::string_view RegionName(ServiceRegion region);

double ExactArea(const ServiceAreaMachine& machine, ServiceRegion region);
// Where the region lies on the line x: `count` spans of y, at most kMostServiceSpans, by rising y.
inline constexpr int kMostServiceSpans = 8;
struct ServiceSpans {
  int count = 0;
  double from_y_mm[kMostServiceSpans] = {};
  double to_y_mm[kMostServiceSpans] = {};
};
ServiceSpans RegionAt(const ServiceAreaMachine& machine, ServiceRegion region, double x_mm);

// c1 of +phi, where the closed form's coordinates have their origin.
struct ServicePoint {
  double x_mm = 0.0, y_mm = 0.0;
};
ServicePoint ClosedFormOrigin(const ServiceAreaMachine& machine);
// Centres of the arcs for a tool tip: joint 1 and 2, tilt +phi and -phi.
ServicePoint ArcCentre(const ServiceAreaMachine& machine, int joint, int tilt_sign);

bool InRegion(const ServiceAreaMachine& machine, ServiceRegion region, double x_mm, double y_mm);

enum class ServiceParameter { kTilt, kPlatformSpacing, kStrutMin, kStrutMax, kToolLength, kBaseSpacing };
struct ServiceSweep {
  std::string_view figure;  // of seed paper 002
  ServiceParameter parameter = ServiceParameter::kTilt;
  std::string_view parameter_name;  // with unit
  double from = 0.0;
  double to = 0.0;
  double printed_percent = 0.0;  // what the paper says the area changes by
  ServiceAreaMachine base;       // with the figure's printed values
};
inline constexpr int kServiceSweeps = 6;
ServiceSweep PaperSweep(int index);  // Figs 3 to 8 are 0 to 5
ServiceAreaMachine AtSweepValue(const ServiceSweep& sweep, double value);

}  // namespace lambdajet::kinematics
