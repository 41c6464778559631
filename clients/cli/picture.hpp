// Draws lines, areas and text into one picture that is written as SVG or PNG, and frames with axes for graphs in it.
//
// Model: cairo records the drawing once and plays it into the file that the path's suffix asks for (.svg or .png).
// Units: a picture's places in px from its upper left corner; a frame's in the numbers of its axes. Threads: one.
// Errors: INVALID_ARGUMENT PICTURE_SUFFIX; INTERNAL FILE_NOT_WRITTEN.
#pragma once

#include <cairo/cairo.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace lambdajet::cli {

struct Colour {
  double red = 0.0, green = 0.0, blue = 0.0, opacity = 1.0;
  Colour Faded(double to_opacity) const { return {red, green, blue, to_opacity}; }
};
inline constexpr Colour kInk{0.13, 0.13, 0.16};
inline constexpr Colour kPale{0.82, 0.83, 0.86};
inline constexpr Colour kBlue{0.12, 0.38, 0.69};
inline constexpr Colour kOrange{0.89, 0.45, 0.08};
inline constexpr Colour kGreen{0.16, 0.55, 0.30};
inline constexpr Colour kRed{0.78, 0.16, 0.18};
inline constexpr Colour kViolet{0.48, 0.27, 0.63};
inline constexpr Colour kGrey{0.45, 0.46, 0.50};

using Points = std::vector<std::pair<double, double>>;

enum class TextAnchor { kLeft, kMiddle, kRight };

class Picture {
 public:
  Picture(double width_px, double height_px);

  void Line(const Points& px, Colour colour, double width_px = 1.5, bool dashed = false);
  void Area(const Points& px, Colour colour);
  void Dot(double x_px, double y_px, double radius_px, Colour colour);
  void Text(double x_px, double y_px, const std::string& text, double size_px = 12.0, Colour colour = kInk,
            TextAnchor anchor = TextAnchor::kLeft, double turn_rad = 0.0);

  absl::Status Write(const std::string& path) const;

 private:
  struct Destroy {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* context) const { cairo_destroy(context); }
  };
  void Trace(const Points& px);
  absl::Status Play(cairo_surface_t* surface, const std::string& path) const;

  double width_px_, height_px_;
  std::unique_ptr<cairo_surface_t, Destroy> record_;
  std::unique_ptr<cairo_t, Destroy> context_;
};

struct Axis {
  double from = 0.0, to = 1.0;
  std::string label;  // with unit
};

// A rectangle of the picture with axes; what leaves it is cut off where it is drawn point by point.
class PlotFrame {
 public:
  struct Place {
    double left_px, top_px, width_px, height_px;
  };
  // `same_scale` widens the shorter axis so that both have one scale. `y_down`: larger y lower in the picture.
  PlotFrame(Picture& picture, Place place, Axis x, Axis y, const std::string& title, bool same_scale = false,
            bool y_down = false);

  void Line(const Points& points, Colour colour, double width_px = 1.8, bool dashed = false);
  void Area(const Points& points, Colour colour);
  void Dot(double x, double y, double radius_px, Colour colour);
  void Text(double x, double y, const std::string& text, Colour colour = kInk, double dx_px = 5.0,
            double dy_px = -5.0, double size_px = 12.0);
  // Lists names with their colours, from the upper left or upper right corner.
  void Legend(const std::vector<std::pair<std::string, Colour>>& entries, bool right = false);

  double X(double x) const;
  double Y(double y) const;
  const Axis& x() const { return x_; }
  const Axis& y() const { return y_; }

 private:
  void DrawAxes(const std::string& title);
  Points Pixels(const Points& points) const;

  Picture& picture_;
  Place place_;
  Axis x_, y_;
  bool y_down_;
};

}  // namespace lambdajet::cli
