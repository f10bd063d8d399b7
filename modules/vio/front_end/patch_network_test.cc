#include "vio/front_end/patch_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vio/front_end/patch_sampler.h"
#include "vio/front_end/test_images.h"

namespace pangea::vio {
namespace {

constexpr HammingLimits kLimits = LimitsOf(DescriptorKind::kPatchNetwork);
const Eigen::Vector3d kUpright = Eigen::Vector3d::UnitY();

using Patch = PatchNetwork::Patch;

Patch PatchAt(const cv::Mat& image, float u, float v, const Eigen::Vector3d& down_cam = kUpright) {
  return PatchSampler(down_cam).Sample(image, {u, v}, 1);
}

Descriptor DescriptorAt(const cv::Mat& image, float u, float v,
                        const Eigen::Vector3d& down_cam = kUpright) {
  const Patch patch = PatchAt(image, u, v, down_cam);
  return PatchNetwork::BuiltIn().Describe(std::span(&patch, 1)).front();
}

// The image rotated clockwise about a pixel.
cv::Mat Rotated(const cv::Mat& image, const cv::Point2f& centre, double angle_deg) {
  cv::Mat rotated;
  cv::warpAffine(image, rotated, cv::getRotationMatrix2D(centre, -angle_deg, 1), image.size());
  return rotated;
}

TEST(PatchSampler, AWholePixelStepCopiesPixels) {
  const cv::Mat image = RandomTexture(200, 160, 1);
  const Patch patch = PatchAt(image, 100.5F, 80.5F);
  EXPECT_EQ(patch[0], image.at<uint8_t>(65, 85));
  EXPECT_EQ(patch[33], image.at<uint8_t>(66, 86));
  EXPECT_EQ(patch.back(), image.at<uint8_t>(96, 116));
}

TEST(PatchSampler, RepeatsTheRim) {
  const cv::Mat image = RandomTexture(200, 160, 1);
  const Patch patch = PatchAt(image, 0.5F, 0.5F);
  EXPECT_EQ(patch[0], image.at<uint8_t>(0, 0));
  EXPECT_EQ(patch.back(), image.at<uint8_t>(16, 16));
}

TEST(PatchSampler, GravityKeepsThePatchUpright) {
  const cv::Mat image = RandomTexture(200, 160, 1);
  for (const double angle_deg : {-90.0, 30.0, 90.0, 170.0}) {
    const cv::Mat rotated = Rotated(image, {100, 80}, angle_deg);
    // Rotated clockwise, what was down points to the left.
    const double angle = angle_deg * CV_PI / 180;
    const Eigen::Vector3d down(-std::sin(angle), std::cos(angle), 0.2);
    const Patch a = PatchAt(image, 100, 80), b = PatchAt(rotated, 100, 80, down);
    double difference = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      difference += std::abs(a[i] - b[i]) / static_cast<double>(a.size());
    }
    EXPECT_LT(difference, 8) << angle_deg;
  }
}

TEST(PatchSampler, ACameraThatLooksDownKnowsNoRoll) {
  const cv::Mat image = RandomTexture(200, 160, 1);
  EXPECT_EQ(PatchAt(image, 100, 80), PatchAt(image, 100, 80, {0.05, 0.01, 1}));
  EXPECT_EQ(PatchAt(image, 100, 80), PatchAt(image, 100, 80, Eigen::Vector3d::Zero()));
}

// The sums as the formula says them.
TEST(PatchKernel, MultipliesFourInputs) {
  constexpr int kOutputs = 24, kLength = 9;
  std::mt19937 rng(1);
  std::vector<int8_t> weights(kOutputs * kLength);
  for (int8_t& weight : weights) {
    weight = static_cast<int8_t>(static_cast<int>(rng() % 255) - 127);
  }
  const PackedWeights packed(weights, kOutputs, kLength);
  ASSERT_EQ(packed.padded_length(), 10);
  std::vector<int16_t> in(4 * 10, 0);
  for (size_t i = 0; i < in.size(); ++i) {
    in[i] = static_cast<int16_t>(i % 10 < kLength ? static_cast<int>(rng() % 255) - 127 : 0);
  }
  std::vector<int32_t> out(4 * kOutputs);
  packed.MultiplyFour(in.data(), out.data());
  for (int input = 0; input < 4; ++input) {
    for (int output = 0; output < kOutputs; ++output) {
      int32_t sum = 0;
      for (int k = 0; k < kLength; ++k) {
        sum += weights[output * kLength + k] * in[input * 10 + k];
      }
      EXPECT_EQ(out[input * kOutputs + output], sum);
    }
  }
}

TEST(PatchKernel, RequantisesAsTheFormulaSays) {
  std::mt19937 rng(1);
  std::vector<int32_t> sums(64);
  std::vector<float> scales(64), offsets(64);
  for (size_t i = 0; i < sums.size(); ++i) {
    sums[i] = static_cast<int32_t>(rng() % 40'000) - 20'000;
    scales[i] = 0.001F * static_cast<float>(1 + rng() % 20);
    offsets[i] = 0.1F * static_cast<float>(rng() % 200) - 10;
  }
  std::vector<int16_t> out(64);
  Requantise(sums.data(), scales.data(), offsets.data(), 64, out.data());
  for (size_t i = 0; i < sums.size(); ++i) {
    const float value = static_cast<float>(sums[i]) * scales[i] + offsets[i];
    EXPECT_EQ(out[i], static_cast<int16_t>(std::nearbyint(std::clamp(value, 0.F, 127.F))));
  }
}

// Fewer patches than are computed together, and more.
TEST(PatchNetwork, ADescriptorDoesNotDependOnItsNeighbours) {
  const cv::Mat image = RandomTexture(752, 480, 1);
  std::vector<Patch> patches;
  for (int i = 0; i < 6; ++i) {
    patches.push_back(PatchAt(image, static_cast<float>(40 + 35 * i), 100));
  }
  const auto together = PatchNetwork::BuiltIn().Describe(patches);
  ASSERT_EQ(together.size(), 6u);
  for (size_t i = 0; i < patches.size(); ++i) {
    EXPECT_EQ(PatchNetwork::BuiltIn().Describe(std::span(&patches[i], 1)).front(), together[i]);
  }
}

// The same bits natively and as WebAssembly, on each processor.
TEST(PatchNetwork, BitsArePinned) {
  Patch patch;
  for (int i = 0; i < PatchNetwork::kPatchPixels; ++i) {
    patch[i] = static_cast<uint8_t>((i * 37 + i / 32 * 11 + i * i % 251) % 256);
  }
  const Descriptor descriptor = PatchNetwork::BuiltIn().Describe(std::span(&patch, 1)).front();
  EXPECT_EQ(descriptor, (Descriptor{11294516837504879456U, 7114447859107352438U,
                                    14787855015105162746U, 3166885723950667299U}));
}

TEST(PatchNetwork, LightChangesFewBits) {
  const cv::Mat image = RandomTexture(200, 160, 1);
  cv::Mat darker;
  image.convertTo(darker, CV_8U, 0.5, 20);
  EXPECT_LE(HammingDistance(DescriptorAt(image, 100, 80), DescriptorAt(darker, 100, 80)), 12);
}

TEST(PatchNetwork, AnotherPointDiffersInAboutHalfOfTheBits) {
  const cv::Mat image = RandomTexture(752, 480, 1);
  double sum = 0;
  for (int i = 0; i < 20; ++i) {
    const auto u = static_cast<float>(40 + 35 * i);
    const int distance = HammingDistance(DescriptorAt(image, u, 100), DescriptorAt(image, u, 300));
    EXPECT_GT(distance, kLimits.predicted);
    sum += distance / 20.0;
  }
  EXPECT_NEAR(sum, 128, 15);
}

TEST(PatchNetwork, ASlightlyMovedPatchStaysNear) {
  const cv::Mat image = RandomTexture(752, 480, 1);
  for (int i = 0; i < 20; ++i) {
    const auto u = static_cast<float>(40 + 35 * i);
    EXPECT_LT(HammingDistance(DescriptorAt(image, u, 100), DescriptorAt(image, u + 1, 100.5F)),
              kLimits.alike);
  }
}

class WeightsFile : public ::testing::Test {
 protected:
  WeightsFile() {
    std::ifstream file(PANGEA_WEIGHTS_FILE, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::string Refusal() const {
    try {
      const PatchNetwork network(bytes_, "some.weights");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  void ExpectRefused(const std::string& field) const {
    const std::string refusal = Refusal();
    for (const std::string& part : {std::string("some.weights"), field, std::string("train")}) {
      EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
    }
  }
  std::vector<uint8_t> bytes_;
};

TEST_F(WeightsFile, IsTheOneBuiltIn) {
  EXPECT_EQ(Refusal(), "");
  EXPECT_LE(bytes_.size(), 200'000u);
  const Patch patch = PatchAt(RandomTexture(200, 160, 3), 100, 80);
  EXPECT_EQ(PatchNetwork(bytes_, "some.weights").Describe(std::span(&patch, 1)),
            PatchNetwork::BuiltIn().Describe(std::span(&patch, 1)));
}

TEST_F(WeightsFile, ADamagedOneIsRefused) {
  bytes_[1000] ^= 4;
  ExpectRefused("checksum");
}

TEST_F(WeightsFile, ATruncatedOneIsRefused) {
  bytes_.resize(bytes_.size() / 2);
  ExpectRefused("checksum");
  bytes_.resize(6);
  ExpectRefused("version");
}

TEST_F(WeightsFile, AnotherVersionIsRefused) {
  bytes_[4] = 9;
  ExpectRefused("version");
}

TEST_F(WeightsFile, AnotherFileIsRefused) {
  bytes_[0] = 'X';
  ExpectRefused("magic");
}

}  // namespace
}  // namespace pangea::vio
