#include "recording/euroc.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "core/median.h"
#include "files/csv.h"
#include "files/make_folder.h"
#include "files/text_file.h"
#include "recording/euroc_calibration.h"
#include "recording/grey_image.h"
#include "recording/image_path.h"
#include "recording/sensor_file.h"
#include "recording/stamps.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> Mav0In(const fs::path& folder) {
  std::error_code error;
  for (const fs::path& candidate : {folder / "mav0", folder}) {
    if (fs::is_directory(candidate / "cam0", error) ||
        fs::is_directory(candidate / "imu0", error)) {
      return candidate.string();
    }
  }
  return std::nullopt;
}

// Advice for a path that is not a recording: what else it probably is.
std::string Hint(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    return path.extension() == ".bag" || path.extension() == ".db3"
               ? "a ROS bag: write its topics into such a folder first"
               : "a file: unpack it, and give the folder that holds mav0";
  }
  for (const fs::directory_entry& inner : fs::directory_iterator(path, error)) {
    if (inner.is_directory(error) && Mav0In(inner.path())) {
      return fmt::format("but {} is one", inner.path().string());
    }
  }
  return fs::is_empty(path, error) ? "the folder is empty" : "it must hold mav0/cam0 and mav0/imu0";
}

std::string FindMav0(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    throw std::runtime_error(
        fmt::format("{}: there is no such recording folder{}", folder,
                    error ? fmt::format(": {}", error.message()) : std::string()));
  }
  if (const auto mav0 = Mav0In(folder)) {
    return *mav0;
  }
  throw std::runtime_error(
      fmt::format("{}: not a recording in EuRoC's format; {}", folder, Hint(folder)));
}

// Warns of image files that the csv does not name: they are not used.
void NameImagesWithoutStamp(const std::string& mav0, const std::vector<CsvRow>& rows,
                            std::vector<std::string>* warnings) {
  std::set<std::string> named;
  for (const CsvRow& row : rows) {
    named.insert(fs::path(ImagePath(mav0, row.fields.back())).filename());
  }
  size_t unnamed = 0;
  std::string first;
  std::error_code error;
  for (const fs::directory_entry& file : fs::directory_iterator(mav0 + "/cam0/data", error)) {
    const std::string name = file.path().filename();
    if (!named.contains(name)) {
      ++unnamed;
      first = first.empty() ? name : std::min(first, name);
    }
  }
  if (unnamed > 0) {
    warnings->push_back(
        fmt::format("{0}/cam0/data: {1} files have no row in {0}/cam0/data.csv, {2} the first; not "
                    "played",
                    mav0, unnamed, first));
  }
}

// Drops the last row if the file was cut off in it, because its last number may be incomplete.
void DropTornTail(std::vector<CsvRow>* rows, const std::string& path,
                  std::vector<std::string>* warnings) {
  if (!rows->empty() && !rows->back().line_ended) {
    warnings->push_back(
        fmt::format("{}:{}: the last row has no line end and may be cut off; row dropped", path,
                    rows->back().line));
    rows->pop_back();
  }
}

// A recording lasts minutes or hours. A time stamp more than a day from its middle is an error, and
// would be taken for the recording's beginning or end.
bool IsFar(int64_t utime, int64_t middle_utime) {
  constexpr int64_t kDay_us = 86'400'000'000;
  return std::abs(utime - middle_utime) > kDay_us;
}

template <typename T>
std::vector<int64_t> UtimesOf(const std::vector<T>& items) {
  std::vector<int64_t> utimes;
  for (const T& item : items) {
    utimes.push_back(item.utime);
  }
  return utimes;
}

template <typename T>
void DropFarStamps(std::vector<T>* items, const std::string& path,
                   std::vector<std::string>* warnings) {
  const int64_t middle = Median(UtimesOf(*items));
  const size_t far =
      std::erase_if(*items, [middle](const T& item) { return IsFar(item.utime, middle); });
  if (far > 0) {
    warnings->push_back(
        fmt::format("{}: {} rows are stamped more than a day from the others; dropped", path, far));
  }
}

void Append(const RowComplaints& complaints, std::vector<std::string>* warnings) {
  for (const std::string& line : complaints.Lines()) {
    warnings->push_back(line + "; row dropped");
  }
}

void Append(const std::vector<std::string>& more, std::vector<std::string>* warnings) {
  warnings->insert(warnings->end(), more.begin(), more.end());
}

// Time stamps must be nanoseconds. In other units, images seem to be less than a millisecond apart.
void CheckUnitOfStamps(const std::vector<EurocImage>& images, const std::string& csv) {
  constexpr double kShortest_us = 1000;
  constexpr size_t kEnough = 10;
  if (images.size() < kEnough) {
    return;
  }
  const auto [first, last] = std::minmax_element(
      images.begin(), images.end(),
      [](const EurocImage& a, const EurocImage& b) { return a.utime < b.utime; });
  const double period_us =
      static_cast<double>(last->utime - first->utime) / static_cast<double>(images.size() - 1);
  if (period_us < kShortest_us) {
    throw std::runtime_error(fmt::format(
        "{}: its images are {:.3g} us apart: are the stamps nanoseconds?", csv, period_us));
  }
}

Trajectory ReadGroundTruthIn(const std::string& mav0, const Rigid3& T_s_body,
                             std::vector<std::string>* warnings) {
  for (const char* sensor : {"state_groundtruth_estimate0", "mocap0"}) {
    const fs::path folder = fs::path(mav0) / sensor;
    if (!Exists((folder / "data.csv").string())) {
      continue;
    }
    try {
      // Both sensors' T_BS go from sensor to rig: T_ref_body = T_ref_gt * T_s_gt^-1 * T_s_body.
      const Rigid3 T_gt_body =
          ReadEurocExtrinsics((folder / "sensor.yaml").string(), warnings).Inverse() * T_s_body;
      Trajectory trajectory = ReadEurocGroundTruth((folder / "data.csv").string(), warnings);
      for (StampedPose& pose : trajectory) {
        pose.T = pose.T * T_gt_body;
      }
      return trajectory;
    } catch (const std::runtime_error& error) {
      warnings->push_back(fmt::format("{}; going on without ground truth", error.what()));
      return {};
    }
  }
  return {};
}

}  // namespace

EurocRecording::EurocRecording(const std::string& folder) : mav0_(FindMav0(folder)) {
  ReadCamera();
  const Rigid3 T_s_body = ReadImuCalibration();
  camera_.T_body_cam = T_s_body.Inverse() * camera_.T_body_cam;
  if (const auto invalid = camera_.Invalid()) {
    throw std::runtime_error(fmt::format(
        "{}: {}; fields 'T_BS' of cam0/sensor.yaml and imu0/sensor.yaml", mav0_, *invalid));
  }
  ReadImages();
  ReadImu();
  DropImagesOutsideImu();
  CheckImages();
  ground_truth_ = ReadGroundTruthIn(mav0_, T_s_body, &warnings_);
}

void EurocRecording::ReadCamera() {
  const std::string file = EurocCalibrationFile(mav0_, "cam0");
  camera_ = ReadEurocCamera(file, &warnings_);
  Append(UnreadFields(file, "cam0"), &warnings_);
  calibration_sigmas_ = ReadEurocCalibrationSigmas(file);
}

Rigid3 EurocRecording::ReadImuCalibration() {
  const std::string file = EurocCalibrationFile(mav0_, "imu0");
  const EurocImuCalibration calibration = ReadEurocImuCalibration(file, &warnings_);
  Append(UnreadFields(file, "imu0"), &warnings_);
  imu_noise_ = calibration.noise;
  return calibration.T_s_body;
}

void EurocRecording::ReadImages() {
  const std::string csv = mav0_ + "/cam0/data.csv";
  const std::vector<CsvRow> rows = ReadCsv(csv);
  RowComplaints malformed(csv);
  RowComplaints missing(csv);
  for (const CsvRow& row : rows) {
    EurocImage image;
    if (row.fields.size() != 2 || row.fields[1].empty() ||
        !ParseNumber(row.fields[0], &image.stamp_ns)) {
      malformed.Add(row.line, "not 'nanoseconds, file name'");
      continue;
    }
    image.utime = UtimeFromNs(image.stamp_ns);
    image.path = ImagePath(mav0_, row.fields[1]);
    std::error_code error;
    if (fs::is_regular_file(image.path, error)) {
      images_.push_back(std::move(image));
    } else {
      missing.Add(row.line, fmt::format("image {} is missing", image.path));
    }
  }
  malformed.ThrowIfTooMany(rows.size(), "nanoseconds, file name");
  Append(malformed, &warnings_);
  Append(missing, &warnings_);
  NameImagesWithoutStamp(mav0_, rows, &warnings_);
  if (images_.empty()) {
    throw std::runtime_error(
        rows.empty()
            ? fmt::format("{}: holds no row; expected: nanoseconds, file name", csv)
            : fmt::format(
                  "{}: none of its {} images is in {}/cam0/data; the first is not there as {}", csv,
                  rows.size(), mav0_, ImagePath(mav0_, rows.front().fields.back())));
  }
  DropFarStamps(&images_, csv, &warnings_);
  CheckUnitOfStamps(images_, csv);
  Warn(SortByTime(&images_), csv, &warnings_);
  const std::string sensor_yaml = EurocCalibrationFile(mav0_, "cam0");
  NameStamps(UtimesOf(images_), 3.5, csv, StatedRate(sensor_yaml, "cam0"), sensor_yaml, &warnings_);
}

void EurocRecording::ReadImu() {
  const std::string csv = mav0_ + "/imu0/data.csv";
  const std::string expected = "nanoseconds, gyro x y z [rad/s], accel x y z [m/s^2]";
  std::vector<CsvRow> rows = ReadCsv(csv);
  const size_t num_rows = rows.size();
  DropTornTail(&rows, csv, &warnings_);
  RowComplaints complaints(csv);
  for (const CsvRow& row : rows) {
    int64_t ns = 0;
    double v[6];
    bool good = row.fields.size() == 7 && ParseNumber(row.fields[0], &ns);
    for (size_t i = 0; good && i < 6; ++i) {
      good = ParseNumber(row.fields[i + 1], &v[i]);
    }
    if (!good) {
      complaints.Add(row.line, fmt::format("not '{}'", expected));
      continue;
    }
    const ImuSample sample{UtimeFromNs(ns), {v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    if (IsPlausible(sample)) {
      imu_.push_back(sample);
    } else {
      complaints.Add(row.line, fmt::format("above {} rad/s or {} m/s^2, which no sensor shows",
                                           kMaxGyro, kMaxAccel));
    }
  }
  complaints.ThrowIfTooMany(num_rows, expected);
  Append(complaints, &warnings_);
  if (imu_.empty()) {
    throw std::runtime_error(fmt::format("{}: holds no sample; expected rows: {}", csv, expected));
  }
  DropFarStamps(&imu_, csv, &warnings_);
  Warn(SortByTime(&imu_), csv, &warnings_);
  const std::string sensor_yaml = EurocCalibrationFile(mav0_, "imu0");
  NameStamps(UtimesOf(imu_), 2.5, csv, imu_noise_.rate_hz, sensor_yaml, &warnings_);
}

void EurocRecording::DropImagesOutsideImu() {
  const size_t before = images_.size();
  // On the clock of the images.
  const auto offset_us = std::llround(1e6 * camera_.time_offset_s);
  const int64_t begin = imu_.front().utime - offset_us;
  const int64_t end = imu_.back().utime - offset_us;
  std::erase_if(images_,
                [&](const EurocImage& image) { return image.utime < begin || image.utime > end; });
  if (images_.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: no image lies within the IMU's time; are imu0 and cam0 of one recording, and both "
        "stamped in nanoseconds?",
        mav0_));
  }
  if (images_.size() < before) {
    warnings_.push_back(
        fmt::format("{}/cam0/data.csv: {} of {} images are outside the IMU's time; "
                    "dropped",
                    mav0_, before - images_.size(), before));
  }
}

// Throws if many images have another size. A single such image is skipped later, as a corrupt one.
void EurocRecording::CheckImages() const {
  constexpr int kOfAnotherSize = 20;  // so many in a row are not accidental
  const cv::Size expected(camera_.width, camera_.height);
  std::string last;
  int of_another_size = 0;
  for (size_t i = 0; i < images_.size() && of_another_size < kOfAnotherSize; ++i) {
    const GreyImage image = ReadGrey(images_[i].path, expected);
    if (!image.pixels.empty()) {
      return;
    }
    of_another_size += !image.size.empty() && image.size != expected ? 1 : 0;
    last = fmt::format("{}: {}", images_[i].path, image.why);
  }
  throw std::runtime_error(fmt::format(
      "{}/cam0/data: none of the images can be used{}; the last one tried: {}", mav0_,
      of_another_size > 0 ? "; the calibration must be of these (cam0/sensor.yaml, field "
                            "'resolution')"
                          : "",
      last));
}

cv::Mat EurocRecording::LoadImage(size_t index, std::string* why) const {
  const std::string& path = images_.at(index).path;
  GreyImage image = ReadGrey(path, {camera_.width, camera_.height});
  if (image.pixels.empty()) {
    *why = fmt::format("{}: {}, skipped", path, image.why);
  }
  return image.pixels;
}

std::optional<int64_t> FirstImageUtimeOf(const std::string& folder) {
  std::vector<int64_t> utimes;
  try {
    for (const CsvRow& row : ReadCsv(FindMav0(folder) + "/cam0/data.csv")) {
      int64_t ns = 0;
      if (ParseNumber(row.fields[0], &ns)) {
        utimes.push_back(UtimeFromNs(ns));
      }
    }
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
  if (utimes.empty()) {
    return std::nullopt;
  }
  const int64_t middle = Median(utimes);
  std::erase_if(utimes, [middle](int64_t utime) { return IsFar(utime, middle); });
  return *std::min_element(utimes.begin(), utimes.end());
}

std::optional<fs::path> FindRecording(const fs::path& wanted) {
  const auto is_recording = [](const fs::path& folder) {
    return fs::is_directory(folder / "mav0") || fs::is_directory(folder / "cam0");
  };
  if (is_recording(wanted)) {
    return wanted;
  }
  const fs::path name = WithoutSlash(wanted);
  const fs::path beside = name.has_parent_path() ? name.parent_path() : ".";
  const std::string prefix = name.filename().string() + "_";
  if (!fs::is_directory(beside)) {
    return std::nullopt;
  }
  std::optional<fs::path> found;
  for (const auto& entry : fs::directory_iterator(beside)) {
    if (entry.path().filename().string().starts_with(prefix) && is_recording(entry.path())) {
      if (found) {
        return std::nullopt;
      }
      found = entry.path();
    }
  }
  return found;
}

Trajectory ReadEurocGroundTruthOf(const std::string& folder, std::vector<std::string>* warnings) {
  const std::string mav0 = FindMav0(folder);
  return ReadGroundTruthIn(mav0, ReadEurocExtrinsics(mav0 + "/imu0/sensor.yaml"), warnings);
}

}  // namespace pangea
