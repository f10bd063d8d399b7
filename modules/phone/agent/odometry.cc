#include "phone/agent/odometry.h"

#include "external_odometry/external_odometry_process.h"
#include "vio/live/sensor_input.h"
#include "vio/vio_process.h"

namespace pangea::phone {
namespace {

vio::VioProcessOptions ProcessOptions(const AgentConfig& config) {
  vio::VioProcessOptions options;
  options.agent_id = config.agent_id;
  options.vio = config.vio;
  options.map_utime = config.opened_utime;
  return options;
}

class OwnOdometry : public Odometry {
 public:
  OwnOdometry(Bus& bus, const AgentConfig& config)
      : vio_(bus, ProcessOptions(config), config.opened_utime), sensors_(vio_) {
    vio_.Open(config.camera, config.imu_noise, config.sigmas);
  }
  void AddImu(const ImuSample& sample) override { sensors_.AddImu(sample); }
  void AddImage(int64_t utime, const cv::Mat& image, const std::optional<Rigid3>&) override {
    if (sensors_.TakeImageStamp(utime)) {
      sensors_.AddImage(utime, image.clone());
    }
  }
  void StartAnew() override { sensors_.StartAnew(); }
  void Flush() override { vio_.Flush(); }
  void Tick(int64_t now_utime) override { vio_.Tick(now_utime); }
  Node& node() override { return vio_.node(); }

 private:
  vio::VioProcess vio_;
  vio::SensorInput sensors_;
};

class DeviceOdometry : public Odometry {
 public:
  DeviceOdometry(Bus& bus, const AgentConfig& config)
      : process_(
            bus, config.agent_id, config.camera,
            [next = config.opened_utime]() mutable { return next++; }, config.opened_utime) {}
  void AddImu(const ImuSample&) override {}
  void AddImage(int64_t utime, const cv::Mat& image,
                const std::optional<Rigid3>& T_odom_body) override {
    process_.AddImage(utime, image, T_odom_body);
  }
  void StartAnew() override { process_.StartAnew(); }
  void Flush() override {}
  void Tick(int64_t now_utime) override { process_.Tick(now_utime); }
  Node& node() override { return process_.node(); }

 private:
  ExternalOdometryProcess process_;
};

}  // namespace

std::unique_ptr<Odometry> MakeOdometry(Bus& bus, const AgentConfig& config) {
  if (config.device_poses) {
    return std::make_unique<DeviceOdometry>(bus, config);
  }
  return std::make_unique<OwnOdometry>(bus, config);
}

}  // namespace pangea::phone
