#include "clients/cli/picture.hpp"

#include <cairo/cairo-svg.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "foundation/contract/trouble.hpp"

namespace lambdajet::cli {
namespace {

void Take(cairo_t* context, Colour colour) {
  cairo_set_source_rgba(context, colour.red, colour.green, colour.blue, colour.opacity);
}

// 1, 2 or 5 times a power of ten, about six to the span.
double TickStep(double span) {
  const double raw = span / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power * 1.0000001) {
      return factor * power;
    }
  }
  return 10.0 * power;
}

std::string TickText(double value, double step) {
  const double shown = std::abs(value) < 1e-9 * step ? 0.0 : value;
  return fmt::format("{:.{}f}", shown,
                     step >= 1.0 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
}

void Widen(Axis& axis, double factor) {
  const double middle = 0.5 * (axis.from + axis.to);
  const double half = 0.5 * (axis.to - axis.from) * factor;
  axis.from = middle - half;
  axis.to = middle + half;
}

}  // namespace

Picture::Picture(double width_px, double height_px) : width_px_(width_px), height_px_(height_px) {
  const cairo_rectangle_t extent{0, 0, width_px, height_px};
  record_.reset(cairo_recording_surface_create(CAIRO_CONTENT_COLOR_ALPHA, &extent));
  context_.reset(cairo_create(record_.get()));
  cairo_set_source_rgb(context_.get(), 1, 1, 1);
  cairo_paint(context_.get());
  cairo_select_font_face(context_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_line_join(context_.get(), CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(context_.get(), CAIRO_LINE_CAP_ROUND);
}

void Picture::Trace(const Points& px) {
  cairo_new_path(context_.get());
  for (const auto& [x, y] : px) {
    cairo_line_to(context_.get(), x, y);
  }
}

void Picture::Line(const Points& px, Colour colour, double width_px, bool dashed) {
  Trace(px);
  const double dash[] = {5.0, 4.0};
  cairo_set_dash(context_.get(), dash, dashed ? 2 : 0, 0.0);
  cairo_set_line_width(context_.get(), width_px);
  Take(context_.get(), colour);
  cairo_stroke(context_.get());
}

void Picture::Area(const Points& px, Colour colour) {
  Trace(px);
  cairo_close_path(context_.get());
  Take(context_.get(), colour);
  cairo_fill(context_.get());
}

void Picture::Dot(double x_px, double y_px, double radius_px, Colour colour) {
  cairo_new_path(context_.get());
  cairo_arc(context_.get(), x_px, y_px, radius_px, 0.0, 2.0 * M_PI);
  Take(context_.get(), colour);
  cairo_fill(context_.get());
}

void Picture::Text(double x_px, double y_px, const std::string& text, double size_px, Colour colour,
                   TextAnchor anchor, double turn_rad) {
  cairo_t* context = context_.get();
  cairo_set_font_size(context, size_px);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  const double share = anchor == TextAnchor::kLeft ? 0.0 : anchor == TextAnchor::kMiddle ? 0.5 : 1.0;
  cairo_save(context);
  cairo_translate(context, x_px, y_px);
  cairo_rotate(context, turn_rad);
  cairo_move_to(context, -share * extents.x_advance, 0.0);
  Take(context, colour);
  cairo_show_text(context, text.c_str());
  cairo_restore(context);
}

absl::Status Picture::Play(cairo_surface_t* surface, const std::string& path) const {
  cairo_t* context = cairo_create(surface);
  cairo_set_source_surface(context, record_.get(), 0, 0);
  cairo_paint(context);
  cairo_status_t status = cairo_status(context);
  cairo_destroy(context);
  if (status == CAIRO_STATUS_SUCCESS && path.ends_with(".png")) {
    status = cairo_surface_write_to_png(surface, path.c_str());
  }
  cairo_surface_finish(surface);
  status = status == CAIRO_STATUS_SUCCESS ? cairo_surface_status(surface) : status;
  cairo_surface_destroy(surface);
  return status == CAIRO_STATUS_SUCCESS ? absl::OkStatus()
                                        : Trouble(absl::StatusCode::kInternal, "FILE_NOT_WRITTEN",
                                                  path + ": " + cairo_status_to_string(status));
}

absl::Status Picture::Write(const std::string& path) const {
  if (path.ends_with(".png")) {
    constexpr double kSharpness = 2.0;
    cairo_surface_t* surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width_px_ * kSharpness),
                                   static_cast<int>(height_px_ * kSharpness));
    cairo_surface_set_device_scale(surface, kSharpness, kSharpness);
    return Play(surface, path);
  }
  if (path.ends_with(".svg")) {
    return Play(cairo_svg_surface_create(path.c_str(), width_px_, height_px_), path);
  }
  return Trouble(absl::StatusCode::kInvalidArgument, "PICTURE_SUFFIX",
                 "a picture is written as .svg or .png, not as '" + path + "'");
}

PlotFrame::PlotFrame(Picture& picture, Place place, Axis x, Axis y, const std::string& title, bool same_scale,
                     bool y_down)
    : picture_(picture), place_(place), x_(std::move(x)), y_(std::move(y)), y_down_(y_down) {
  if (!(x_.to > x_.from)) {
    x_.to = x_.from + 1.0;
  }
  if (!(y_.to > y_.from)) {
    y_.to = y_.from + 1.0;
  }
  if (same_scale) {
    const double ratio = (x_.to - x_.from) / place_.width_px / ((y_.to - y_.from) / place_.height_px);
    ratio > 1.0 ? Widen(y_, ratio) : Widen(x_, 1.0 / ratio);
  }
  DrawAxes(title);
}

double PlotFrame::X(double x) const {
  return place_.left_px + (x - x_.from) / (x_.to - x_.from) * place_.width_px;
}

double PlotFrame::Y(double y) const {
  const double share = (y - y_.from) / (y_.to - y_.from);
  return place_.top_px + (y_down_ ? share : 1.0 - share) * place_.height_px;
}

void PlotFrame::DrawAxes(const std::string& title) {
  const double right = place_.left_px + place_.width_px;
  const double bottom = place_.top_px + place_.height_px;
  const double x_step = TickStep(x_.to - x_.from);
  for (double x = std::ceil(x_.from / x_step - 1e-9) * x_step; x <= x_.to + 1e-9 * x_step; x += x_step) {
    picture_.Line({{X(x), place_.top_px}, {X(x), bottom}}, kPale, 0.6);
    picture_.Text(X(x), bottom + 15, TickText(x, x_step), 11, kGrey, TextAnchor::kMiddle);
  }
  const double y_step = TickStep(y_.to - y_.from);
  for (double y = std::ceil(y_.from / y_step - 1e-9) * y_step; y <= y_.to + 1e-9 * y_step; y += y_step) {
    picture_.Line({{place_.left_px, Y(y)}, {right, Y(y)}}, kPale, 0.6);
    picture_.Text(place_.left_px - 6, Y(y) + 4, TickText(y, y_step), 11, kGrey, TextAnchor::kRight);
  }
  picture_.Line({{place_.left_px, place_.top_px},
                 {right, place_.top_px},
                 {right, bottom},
                 {place_.left_px, bottom},
                 {place_.left_px, place_.top_px}},
                kGrey, 0.8);
  picture_.Text(place_.left_px + 0.5 * place_.width_px, bottom + 32, x_.label, 12, kInk, TextAnchor::kMiddle);
  picture_.Text(place_.left_px - 54, place_.top_px + 0.5 * place_.height_px, y_.label, 12, kInk,
                TextAnchor::kMiddle, -M_PI / 2);
  picture_.Text(place_.left_px, place_.top_px - 9, title, 13.5);
}

Points PlotFrame::Pixels(const Points& points) const {
  Points px;
  px.reserve(points.size());
  for (const auto& [x, y] : points) {
    px.emplace_back(std::clamp(X(x), place_.left_px, place_.left_px + place_.width_px),
                    std::clamp(Y(y), place_.top_px, place_.top_px + place_.height_px));
  }
  return px;
}

// Pieces inside the frame only: a point outside breaks the line.
void PlotFrame::Line(const Points& points, Colour colour, double width_px, bool dashed) {
  const auto inside = [&](const std::pair<double, double>& p) {
    const double margin_x = 1e-9 * (x_.to - x_.from);
    const double margin_y = 1e-9 * (y_.to - y_.from);
    return std::isfinite(p.second) && p.first >= x_.from - margin_x && p.first <= x_.to + margin_x &&
           p.second >= y_.from - margin_y && p.second <= y_.to + margin_y;
  };
  Points piece;
  const auto flush = [&] {
    if (piece.size() > 1) {
      picture_.Line(Pixels(piece), colour, width_px, dashed);
    }
    piece.clear();
  };
  for (const auto& point : points) {
    if (inside(point)) {
      piece.push_back(point);
    } else {
      flush();
    }
  }
  flush();
}

void PlotFrame::Area(const Points& points, Colour colour) { picture_.Area(Pixels(points), colour); }

void PlotFrame::Dot(double x, double y, double radius_px, Colour colour) {
  picture_.Dot(X(x), Y(y), radius_px, colour);
}

void PlotFrame::Text(double x, double y, const std::string& text, Colour colour, double dx_px, double dy_px,
                     double size_px) {
  picture_.Text(X(x) + dx_px, Y(y) + dy_px, text, size_px, colour);
}

void PlotFrame::Legend(const std::vector<std::pair<std::string, Colour>>& entries, bool right) {
  double y = place_.top_px + 18;
  const double x = right ? place_.left_px + place_.width_px - 14 : place_.left_px + 14;
  for (const auto& [name, colour] : entries) {
    picture_.Line({{right ? x - 18 : x, y - 4}, {right ? x : x + 18, y - 4}}, colour, 3.0);
    picture_.Text(right ? x - 24 : x + 24, y, name, 11.5, kInk,
                  right ? TextAnchor::kRight : TextAnchor::kLeft);
    y += 16;
  }
}

}  // namespace lambdajet::cli
