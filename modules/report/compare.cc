#include "report/compare.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "eval/table.h"
#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char kReport[] = "report.json";
constexpr char kTiming[] = "timing.json";

fs::path ReportOf(const fs::path& run) {
  fs::path file = fs::is_directory(run) ? run / kReport : run;
  if (!fs::is_regular_file(file)) {
    throw std::runtime_error(
        fmt::format("{}: no report here; give a folder of run, replay or report", file.string()));
  }
  if (file.extension() != ".json") {
    throw std::runtime_error(
        fmt::format("{}: is no report.json; of a log, pangea-session report {} --out DIR makes one",
                    file.string(), file.string()));
  }
  return file;
}

json ReadJson(const fs::path& file) {
  try {
    return json::parse(ReadTextFile(file));
  } catch (const json::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
}

std::string Text(const json& value, const char* format) {
  return value.is_number() ? fmt::format(fmt::runtime(format), value.get<double>()) : "-";
}

std::string Nees(const json& truth) {
  const json& nees = truth.at("nees_per_dim");
  return nees.is_null() ? "-" : Text(nees.at("mean"), "{:.2f}");
}

// Number of wrong constraints; only known with ground truth.
std::string Wrong(const json& truth) {
  const int64_t checked = truth.at("checked").get<int64_t>();
  return checked == 0 ? "-" : fmt::format("{} of {}", truth.at("wrong").get<int64_t>(), checked);
}

std::string WallTime(const fs::path& folder) {
  const fs::path file = folder / kTiming;
  return fs::exists(file) ? Text(ReadJson(file).at("wall_s"), "{:.1f}") : "-";
}

void AddRow(const fs::path& run, const fs::path& file, const json& report, Table* table) {
  const json& constraints = report.at("constraints");
  const json& truth = report.at("constraints_truth");
  table->Add({run.string(), Text(constraints.at("accepted"), "{:.0f}"),
              Text(constraints.at("refused"), "{:.0f}"), Wrong(truth), Nees(truth),
              Text(report.at("ate_joint_m"), "{:.4f}"),
              fmt::format("{}", report.at("groups").size()), WallTime(file.parent_path())});
}

// The options, from the notes of the report.
std::string OptionsOf(const fs::path& run, const json& report) {
  std::string text;
  for (const json& note : report.at("notes")) {
    if (const std::string line = note.get<std::string>(); line.starts_with("option")) {
      text += fmt::format("{}: {}\n", run.string(), line);
    }
  }
  return text;
}

}  // namespace

void WriteTiming(double wall_s, const fs::path& folder) {
  WriteTextFile(folder / kTiming, json{{"wall_s", wall_s}}.dump(2) + "\n");
}

std::string CompareRuns(const std::vector<fs::path>& runs) {
  Table table(
      {"run", "accepted", "refused", "wrong", "NEES per dim", "ATE joint m", "groups", "time s"});
  std::string options;
  for (const fs::path& run : runs) {
    const fs::path file = ReportOf(run);
    const json report = ReadJson(file);
    try {
      AddRow(run, file, report, &table);
      options += OptionsOf(run, report);
    } catch (const json::exception& error) {
      throw std::runtime_error(
          fmt::format("{}: is no report of this version: {}", file.string(), error.what()));
    }
  }
  return table.Text() + (options.empty() ? "" : "\n" + options);
}

}  // namespace pangea
