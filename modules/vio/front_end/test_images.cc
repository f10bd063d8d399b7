#include "vio/front_end/test_images.h"

#include <opencv2/imgproc.hpp>

#include "core/testing/test_cameras.h"

namespace pangea::vio {

cv::Mat RandomTexture(int width, int height, uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat sum(height, width, CV_32F, cv::Scalar(128));
  for (int cell = 4; cell <= 128; cell *= 2) {
    cv::Mat noise(height / cell + 2, width / cell + 2, CV_32F);
    random.fill(noise, cv::RNG::UNIFORM, -35.0, 35.0);
    cv::Mat large;
    cv::resize(noise, large, sum.size(), 0, 0, cv::INTER_CUBIC);
    sum += large;
  }
  cv::Mat image;
  sum.convertTo(image, CV_8U);
  return image;
}

CameraModel PlainCamera() { return PinholeTestCamera(752, 480, 460); }

cv::Mat RotatedView(const cv::Mat& image, const CameraModel& camera, const Eigen::Quaterniond& q) {
  cv::Mat map_x(image.size(), CV_32F), map_y(image.size(), CV_32F), rotated;
  const Eigen::Matrix3d R_before_after = q.conjugate().toRotationMatrix();
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector3d ray((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
      const Eigen::Vector3d before = R_before_after * ray;
      map_x.at<float>(y, x) = static_cast<float>(camera.fx * before.x() / before.z() + camera.cx);
      map_y.at<float>(y, x) = static_cast<float>(camera.fy * before.y() / before.z() + camera.cy);
    }
  }
  cv::remap(image, rotated, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  return rotated;
}

}  // namespace pangea::vio
