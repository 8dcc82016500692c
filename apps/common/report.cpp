// report.cpp -- see report.h.
#include "common/report.h"

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/files.h"
#include "common/plots.h"
#include "common/process.h"

namespace apps {

using nlohmann::json;

namespace {

constexpr const char* report_version = "0.1.0";

// JSON has neither infinity nor NaN.
json finite_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json numbers(const std::vector<double>& values) {
  json out = json::array();
  for (const double v : values) out.push_back(finite_or_null(v));
  return out;
}

json plot_json(const Plot& plot) {
  json series = json::array();
  for (const PlotSeries& s : plot.series) {
    series.push_back(
        {{"name", s.name}, {"x", numbers(s.x)}, {"y", numbers(s.y)}, {"labels", s.labels}});
  }
  return {{"file", plot.file},       {"title", plot.title}, {"x_label", plot.x_label},
          {"y_label", plot.y_label}, {"log_x", plot.log_x}, {"log_y", plot.log_y},
          {"series", series}};
}

std::string cell_text(const json& cell) {
  if (cell.is_string()) return cell.get<std::string>();
  if (!cell.is_number_float()) return cell.is_null() ? "-" : cell.dump();
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", cell.get<double>());
  return text;
}

template <typename Cells>
std::string markdown_row(const Cells& cells) {
  std::string row = "|";
  for (const auto& cell : cells) row += " " + cell_text(json(cell)) + " |";
  return row + "\n";
}

}  // namespace

PlotSeries loss_series(const std::string& name, std::span<const LossSample> samples) {
  PlotSeries series{name, {}, {}};
  for (const LossSample& sample : samples) {
    series.x.push_back(sample.seconds);
    series.y.push_back(sample.loss);
  }
  return series;
}

std::string Table::to_markdown() const {
  std::string out = markdown_row(head) + "|";
  for (size_t n = 0; n < head.size(); ++n) out += "---|";
  out += "\n";
  for (const auto& row : rows) out += markdown_row(row);
  return out;
}

Report::Report(std::string program, const CommonOptions& options)
    : program_(std::move(program)), options_(options), start_(std::chrono::steady_clock::now()) {}

void Report::add_number(const std::string& name, double value, const std::string& unit,
                        std::optional<double> before, const std::string& limit) {
  numbers_.push_back({{"name", name},
                      {"value", finite_or_null(value)},
                      {"unit", unit},
                      {"before", before ? finite_or_null(*before) : json(nullptr)},
                      {"limit", limit}});
}

void Report::add_picture(const std::string& file, const std::string& caption) {
  pictures_.push_back({{"file", file}, {"caption", caption}});
}

json Report::to_json(long steps, bool stopped) const {
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
  json plots = json::array(), tables = json::array();
  for (const Plot& plot : plots_) plots.push_back(plot_json(plot));
  for (const Table& table : tables_)
    tables.push_back({{"title", table.title}, {"head", table.head}, {"rows", table.rows}});
  return {{"program", program_},
          {"version", report_version},
          {"input", options_.input.string()},
          {"options", apps::to_json(options_)},
          {"threads", options_.threads},
          {"seconds", taken.count()},
          {"peak_memory_mb", peak_memory_mb()},
          {"steps", steps},
          {"stopped", stopped},
          {"numbers", numbers_},
          {"pictures", pictures_},
          {"plots", plots},
          {"tables", tables},
          {"notes", notes_},
          {program_, own}};
}

void Report::write(long steps, bool stopped) const {
  const std::filesystem::path path = options_.output / "report.json";
  write_file(path, to_json(steps, stopped).dump(1) + "\n");
  if (!plots_.empty()) draw_plots(path);
}

void report_tables(const std::string& program, const CommonOptions& options,
                   const std::vector<Table>& tables) {
  Report report(program, options);
  for (const Table& table : tables) report.add_table(table);
  report.write(0, false);
  for (const Table& table : tables) std::fputs(table.to_markdown().c_str(), stdout);
}

}  // namespace apps
