#pragma once

// What a blob looks like: SIFT's histograms of gradients (Lowe, IJCV 2004, sections 5 and 6), of
// which 256 bits are kept. These are signs of random projections, which keep angles between
// vectors (Charikar, STOC 2002): two rounds of random signs and a Hadamard transform, 128 bits, and
// two others for the other 128 (Ailon and Chazelle, STOC 2006).

#include <span>
#include <vector>

#include "core/keyframe.h"
#include "vio/front_end/scale_space.h"

namespace pangea::vio {

// One for each direction in which it may be seen: the strongest gradient's, and others about as
// strong.
std::vector<Descriptor> DescribeBlob(const ScaleSpace& space, const Blob& blob);

// Of a histogram of 128 bins.
Descriptor SignsOfProjections(std::span<const float> histogram);

}  // namespace pangea::vio
