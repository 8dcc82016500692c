// report.h -- writes an app's report.json: a common head, plots, pictures, tables, and the app's own part.
//
//   apps::Report report("denoise", common);
//   report.own["psnr_db"] = 31.2;
//   report.add_number("PSNR", 31.2, "dB", 27.9);              // with the value before
//   report.add_picture("result.png", "after 300 steps");
//   report.add_plot({.file = "error_vs_time.png", .title = "...", .series = {...}});
//   report.write(300, apps::stop_requested());                // report.json, then the plots
//
// One script draws the plots of all apps, plot_series.py. make_index.py shows pictures, plots, numbers and tables of
// all reports on one page.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/minimize.h"
#include "common/options.h"

namespace apps {

// One curve, or labelled points.
struct PlotSeries {
  std::string name;
  std::vector<double> x, y;
  std::vector<std::string> labels = {};  // one per point; empty: a curve
};
PlotSeries loss_series(const std::string& name, std::span<const LossSample> samples);

struct Plot {
  std::string file = "error_vs_time.png";
  std::string title;
  std::string x_label = "run time [s]", y_label = "loss";
  bool log_x = false, log_y = false;
  std::vector<PlotSeries> series = {};
};

// Cells are text or numbers.
struct Table {
  std::string title;
  std::vector<std::string> head;
  std::vector<std::vector<nlohmann::json>> rows = {};

  std::string to_markdown() const;
};

class Report {
 public:
  Report(std::string program, const CommonOptions& options);

  nlohmann::json own = nlohmann::json::object();  // the app's own part

  // A headline number. `limit` is text such as "at least 36".
  void add_number(const std::string& name, double value, const std::string& unit = "",
                  std::optional<double> before = {}, const std::string& limit = "");
  void add_picture(const std::string& file, const std::string& caption);
  void add_plot(Plot plot) { plots_.push_back(std::move(plot)); }
  void add_table(Table table) { tables_.push_back(std::move(table)); }
  void add_note(const std::string& note) { notes_.push_back(note); }

  nlohmann::json to_json(long steps, bool stopped) const;
  // Writes report.json to the output folder, then draws every plot beside it. Throws retrograde::UserError.
  void write(long steps, bool stopped) const;

 private:
  std::string program_;
  CommonOptions options_;
  std::chrono::steady_clock::time_point start_;
  nlohmann::json numbers_ = nlohmann::json::array(), pictures_ = nlohmann::json::array();
  std::vector<Plot> plots_;
  std::vector<Table> tables_;
  std::vector<std::string> notes_;
};

// Writes a report that has only these tables, as checks do, and prints them. Throws retrograde::UserError.
void report_tables(const std::string& program, const CommonOptions& options,
                   const std::vector<Table>& tables);

}  // namespace apps
