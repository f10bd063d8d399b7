// Exports PhoneAgent and CameraCalibration to JavaScript. The JavaScript side, with the types, is
// in page/src/agent/.

#include <emscripten/bind.h>
#include <emscripten/heap.h>
#include <emscripten/val.h>
#include <fmt/format.h>

#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>

#include "pangea/pose_t.hpp"
#include "phone/agent/camera_calibration.h"
#include "phone/agent/phone_agent.h"

namespace pangea::phone {
namespace {

using emscripten::val;

val Copy(const std::vector<uint8_t>& bytes) {
  return val::global("Uint8Array")
      .new_(val(emscripten::typed_memory_view(bytes.size(), bytes.data())));
}

std::vector<uint8_t> ToBytes(const val& array) {
  return emscripten::convertJSArrayToNumberVector<uint8_t>(array);
}

val ToArray(const Rigid3& T) {
  val array = val::array();
  for (const double value : {T.t.x(), T.t.y(), T.t.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()}) {
    array.call<void>("push", value);
  }
  return array;
}

std::vector<double> Numbers(const val& object, const char* field, size_t count) {
  std::vector<double> numbers = emscripten::convertJSArrayToNumberVector<double>(object[field]);
  if (numbers.size() != count) {
    throw std::runtime_error(fmt::format("{}: {} numbers, not {}", field, count, numbers.size()));
  }
  return numbers;
}

Rigid3 ToRigid3(const std::vector<double>& T) {
  return {Eigen::Quaterniond(T.at(6), T.at(3), T.at(4), T.at(5)).normalized(),
          {T.at(0), T.at(1), T.at(2)}};
}

std::string Text(const val& object, const char* field) {
  const val value = object[field];
  return value.isString() ? value.as<std::string>() : "";
}

val ToObject(const PhonePose& pose) {
  const char* const state = pose.state == pose_t::STATE_TRACKING ? "tracking"
                            : pose.state == pose_t::STATE_LOST   ? "lost"
                                                                 : "initialising";
  val object = val::object();
  object.set("utime", static_cast<double>(pose.utime));
  object.set("state", std::string(state));
  object.set("reason", pose.reason);
  object.set("map", ToString(pose.map));
  object.set("T_odom_body", ToArray(pose.T_odom_body));
  object.set("numTracked", pose.num_tracked);
  object.set("fused", pose.in_group && pose.in_group->group != pose.map);
  if (pose.in_group) {
    object.set("T_map_body", ToArray(pose.in_group->T_map_body));
    object.set("group", ToString(pose.in_group->group));
  }
  return object;
}

val ToObject(const CameraModel& camera) {
  const Eigen::Vector4d& d = camera.distortion;
  val object = val::object();
  object.set("model",
             std::string(camera.kind == CameraModel::Kind::kEquidistant ? "equidistant"
                                                                        : "radial-tangential"));
  object.set("width", camera.width);
  object.set("height", camera.height);
  object.set("intrinsics", val::array(std::vector{camera.fx, camera.fy, camera.cx, camera.cy}));
  object.set("distortion", val::array(std::vector{d[0], d[1], d[2], d[3]}));
  object.set("T_body_cam", ToArray(camera.T_body_cam));
  object.set("readout_s", camera.readout_s);
  return object;
}

val ToObject(const status_t& status) {
  val counters = val::object();
  counters.set("pending", static_cast<double>(status.pending));
  for (const counter_t& counter : status.counters) {
    counters.set(counter.name, static_cast<double>(counter.count));
  }
  for (const counter_t& counter : status.refused) {
    counters.set("refused: " + counter.name, static_cast<double>(counter.count));
  }
  val object = val::object();
  object.set("text", status.summary);
  object.set("counters", counters);
  return object;
}

val ToObject(const DrawnAnchor& anchor) {
  val object = val::object();
  object.set("id", ToString(anchor.id));
  object.set("name", anchor.name);
  object.set("payload", anchor.payload);
  object.set("owner", anchor.id.agent_id);
  object.set("T_odom_anchor", ToArray(anchor.T_odom_anchor));
  object.set("sigma_m", anchor.sigma_m);
  object.set("revision", static_cast<double>(anchor.revision));
  return object;
}

val ToObject(const OtherAgent& other) {
  val object = val::object();
  object.set("agent", other.agent_id);
  object.set("T_odom_cam", ToArray(other.T_odom_cam));
  return object;
}

val ToObject(const SpoolChange& change) {
  val object = val::object();
  object.set("op", std::string(change.bytes.empty() ? "delete" : "put"));
  object.set("id", change.id);
  if (!change.bytes.empty()) {
    object.set("bytes", Copy(change.bytes));
  }
  return object;
}

template <typename Items, typename Convert>
val ToArrayOf(const Items& items, Convert convert) {
  val array = val::array();
  for (const auto& item : items) {
    array.call<void>("push", convert(item));
  }
  return array;
}

val ToObject(const PhoneEvents& events) {
  val object = val::object();
  object.set("linkUp", ToArrayOf(events.link_up, Copy));
  object.set("keyframes", ToArrayOf(events.keyframes, Copy));
  object.set("spool", ToArrayOf(events.spool, [](const auto& c) { return ToObject(c); }));
  if (events.pose) {
    object.set("pose", ToObject(*events.pose));
  }
  if (events.camera) {
    object.set("camera", ToObject(*events.camera));
  }
  if (events.anchors) {
    object.set("anchors", ToArrayOf(*events.anchors, [](const auto& a) { return ToObject(a); }));
  }
  if (events.others) {
    val others = val::object();
    others.set("map", ToString(events.others->map));
    others.set("others",
               ToArrayOf(events.others->others, [](const auto& o) { return ToObject(o); }));
    object.set("others", others);
  }
  if (events.vio_status || events.uplink_status) {
    val status = val::object();
    if (events.vio_status) {
      status.set("vio", ToObject(*events.vio_status));
    }
    if (events.uplink_status) {
      status.set("uplink", ToObject(*events.uplink_status));
    }
    object.set("status", status);
  }
  return object;
}

// PhoneAgent with methods that take and return JavaScript's types, for emscripten's class.
class Agent {
 public:
  explicit Agent(const AgentConfig& config) : agent_(config) {}

  val ImageBuffer(size_t bytes) {
    image_.resize(bytes);
    return val(emscripten::typed_memory_view(image_.size(), image_.data()));
  }
  void AddImu(double utime, double gx, double gy, double gz, double ax, double ay, double az) {
    agent_.AddImu({static_cast<int64_t>(utime), {gx, gy, gz}, {ax, ay, az}});
  }
  void AddImage(double utime, int width, int height) {
    agent_.AddImage(static_cast<int64_t>(utime), cv::Mat(height, width, CV_8U, image_.data()));
  }
  // `T_odom_body` is null while the device's odometry is lost.
  void AddPosedImage(double utime, int width, int height, const val& T_odom_body) {
    std::optional<Rigid3> T;
    if (T_odom_body.isArray()) {
      T = ToRigid3(emscripten::convertJSArrayToNumberVector<double>(T_odom_body));
    }
    agent_.AddImage(static_cast<int64_t>(utime), cv::Mat(height, width, CV_8U, image_.data()), T);
  }
  void OnLinkDown(const val& packet) { agent_.OnLinkDown(ToBytes(packet)); }
  void Restore(const std::string& id, const val& bytes) { agent_.Restore(id, ToBytes(bytes)); }
  std::string PlaceAnchor(const val& edit) {
    try {
      NewAnchor anchor;
      anchor.name = Text(edit, "name");
      anchor.payload = Text(edit, "payload");
      anchor.utime = static_cast<int64_t>(edit["utime"].as<double>());
      if (edit["pixel"].isArray()) {
        const std::vector<double> pixel = Numbers(edit, "pixel", 2);
        anchor.pixel = Eigen::Vector2d(pixel[0], pixel[1]);
      } else {
        anchor.T_body_anchor = ToRigid3(Numbers(edit, "T_body_anchor", 7));
      }
      return ToString(agent_.PlaceAnchor(anchor));
    } catch (const std::exception& error) {
      return std::string("error: ") + error.what();
    }
  }
  void RemoveAnchor(const std::string& text) {
    const size_t slash = text.find('/');
    if (slash != std::string::npos) {
      agent_.RemoveAnchor({std::atoi(text.c_str()), std::atoll(text.c_str() + slash + 1)});
    }
  }
  void Poll(double now_us) { agent_.Poll(static_cast<int64_t>(now_us)); }
  void StartAnew() { agent_.StartAnew(); }
  void Flush() { agent_.Flush(); }
  val Take() { return ToObject(agent_.Take()); }

 private:
  PhoneAgent agent_;
  std::vector<uint8_t> image_;
};

// Errors are returned as texts, because JavaScript cannot read C++ exceptions.
val CreateAgent(const val& config) {
  val result = val::object();
  try {
    AgentTexts texts;
    texts.agent = config["agent"].as<double>();
    texts.opened_utime = config["openedUtime"].as<double>();
    texts.key_hex = Text(config, "keyHex");
    texts.camera_yaml = Text(config, "cameraYaml");
    texts.imu_yaml = Text(config, "imuYaml");
    texts.vio_options_yaml = Text(config, "vioOptionsYaml");
    texts.uplink_options_yaml = Text(config, "uplinkOptionsYaml");
    texts.device_poses = config["devicePoses"].isTrue();
    result.set("agent", val(std::make_shared<Agent>(ReadAgentConfig(texts))));
  } catch (const std::exception& error) {
    result.set("error", std::string(error.what()));
  }
  return result;
}

class Calibration {
 public:
  explicit Calibration(const val& config)
      : width_(config["width"].as<int>()),
        height_(config["height"].as<int>()),
        image_(static_cast<size_t>(width_) * static_cast<size_t>(height_)),
        calibration_(width_, height_, Text(config, "imuYaml"), RotationOf(config)) {}

  val ImageBuffer() { return val(emscripten::typed_memory_view(image_.size(), image_.data())); }
  void AddImu(double utime, double gx, double gy, double gz, double ax, double ay, double az) {
    calibration_.AddImu({static_cast<int64_t>(utime), {gx, gy, gz}, {ax, ay, az}});
  }
  void AddImage(double utime) {
    calibration_.AddImage(static_cast<int64_t>(utime),
                          cv::Mat(height_, width_, CV_8U, image_.data()));
  }
  val Progress() const {
    const CalibrationProgress progress = calibration_.progress();
    val object = val::object();
    object.set("share", progress.share);
    object.set("missing", progress.missing);
    return object;
  }
  val Solve() const {
    const CameraCalibration::Outcome outcome = calibration_.Solve();
    val object = val::object();
    object.set("cameraYaml", outcome.camera_yaml);
    object.set("refused", outcome.refused);
    return object;
  }

 private:
  static std::optional<Eigen::Quaterniond> RotationOf(const val& config) {
    if (!config["q_body_cam"].isArray()) {
      return std::nullopt;
    }
    const std::vector<double> q = Numbers(config, "q_body_cam", 4);
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  }

  int width_, height_;
  std::vector<uint8_t> image_;
  CameraCalibration calibration_;
};

val CreateCalibration(const val& config) {
  val result = val::object();
  try {
    result.set("calibration", val(std::make_shared<Calibration>(config)));
  } catch (const std::exception& error) {
    result.set("error", std::string(error.what()));
  }
  return result;
}

EMSCRIPTEN_BINDINGS(pangea_phone_agent) {
  emscripten::class_<Agent>("Agent")
      .smart_ptr<std::shared_ptr<Agent>>("AgentPointer")
      .function("imageBuffer", &Agent::ImageBuffer)
      .function("addImu", &Agent::AddImu)
      .function("addImage", &Agent::AddImage)
      .function("addPosedImage", &Agent::AddPosedImage)
      .function("onLinkDown", &Agent::OnLinkDown)
      .function("restore", &Agent::Restore)
      .function("placeAnchor", &Agent::PlaceAnchor)
      .function("removeAnchor", &Agent::RemoveAnchor)
      .function("poll", &Agent::Poll)
      .function("startAnew", &Agent::StartAnew)
      .function("flush", &Agent::Flush)
      .function("take", &Agent::Take);
  emscripten::class_<Calibration>("Calibration")
      .smart_ptr<std::shared_ptr<Calibration>>("CalibrationPointer")
      .function("imageBuffer", &Calibration::ImageBuffer)
      .function("addImu", &Calibration::AddImu)
      .function("addImage", &Calibration::AddImage)
      .function("progress", &Calibration::Progress)
      .function("solve", &Calibration::Solve);
  emscripten::function("createAgent", &CreateAgent);
  emscripten::function("createCalibration", &CreateCalibration);
  emscripten::function("heapBytes", &emscripten_get_heap_size);
}

}  // namespace
}  // namespace pangea::phone
