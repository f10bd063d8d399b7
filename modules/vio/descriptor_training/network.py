"""The network of front_end/patch_network.h, its loss, and its integer weights."""

import struct

import numpy
import torch
from torch import nn
from torch.nn import functional

CHANNELS = (16, 24, 40)
BITS = 256
MAX_DEVIATIONS = 4.0  # as in patch_network.cc
MIN_DEVIATION = 2.0
SHARPNESS = 24.0  # of the softmax over similarities in -1 .. 1
SAME_POINT_STEPS = 8.0  # nearer than so many patch pixels, two points of a view may be one
FORMAT_VERSION = 1


class Sign(torch.autograd.Function):
    """The sign; its gradient is that of tanh."""

    @staticmethod
    def forward(ctx, x):
        ctx.save_for_backward(x)
        return torch.where(x >= 0, 1.0, -1.0)

    @staticmethod
    def backward(ctx, gradient):
        (x,) = ctx.saved_tensors
        return gradient * (1 - torch.tanh(x) ** 2)


def normalised(patches):
    x = torch.as_tensor(patches).float()
    mean = x.mean((1, 2), keepdim=True)
    deviation = ((x - mean) ** 2).mean((1, 2), keepdim=True).sqrt()
    return ((x - mean) / (deviation + MIN_DEVIATION)).clamp(-MAX_DEVIATIONS, MAX_DEVIATIONS)[:, None]


class PatchNetwork(nn.Module):
    def __init__(self):
        super().__init__()
        layers = []
        for inputs, outputs in zip((1, *CHANNELS), CHANNELS):
            convolution = nn.Conv2d(inputs, outputs, 3, stride=2, padding=1, bias=False)
            layers.append(nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.ReLU()))
        self.convolutions = nn.Sequential(*layers)
        self.dropout = nn.Dropout(0.1)
        self.linear = nn.Linear(16 * CHANNELS[-1], BITS, bias=False)
        self.balance = nn.BatchNorm1d(BITS, affine=False)  # each bit is set in half of the patches

    def forward(self, x):
        return self.balance(self.linear(self.dropout(self.convolutions(x).flatten(1))))


def loss(first, second, places, scenes):
    """Softmax cross entropy: each patch of a view has to find its pair among all other patches of the
    batch, in both views. Points of one scene that may be the same are not counted as others."""
    a, b = Sign.apply(first), Sign.apply(second)
    step = torch.maximum(places[:, None, 2], places[None, :, 2])
    distance = (places[:, None, :2] - places[None, :, :2]).norm(dim=2)
    same = (scenes[:, None] == scenes[None]) & (distance < SAME_POINT_STEPS * step)
    label = torch.arange(len(a))
    pair = torch.eye(len(a), dtype=torch.bool)
    across = (SHARPNESS / BITS * a @ b.t()).masked_fill(same & ~pair, -1e4)
    within = [(SHARPNESS / BITS * x @ x.t()).masked_fill(same, -1e4) for x in (a, b)]
    found = (across.argmax(1) == label).float().mean().item()
    total = functional.cross_entropy(torch.cat([across, within[0]], 1), label)
    total = total + functional.cross_entropy(torch.cat([across.t(), within[1]], 1), label)
    return total, found


def checksum(data):
    """FNV-1a, 32 bits."""
    value = 2166136261
    for byte in data:
        value = ((value ^ byte) * 16777619) & 0xFFFFFFFF
    return value


def quantised(weights):
    """Integers of -127 .. 127 for each output, and the output's scale."""
    scale = weights.abs().flatten(1).amax(1) / 127
    shape = (-1, *[1] * (weights.dim() - 1))
    return torch.round(weights / scale.view(shape)).to(torch.int8).numpy(), scale.numpy()


def weights_file(network, patches):
    """The bytes of the weights file (front_end/patch_network.cc). `patches` show the range of each
    layer's outputs."""
    network.eval()
    data = b"PGDW" + struct.pack("<4I", FORMAT_VERSION, *CHANNELS)
    with torch.no_grad():
        x, scale_in = normalised(patches), MAX_DEVIATIONS / 127
        for convolution, norm, _ in network.convolutions:
            gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            weights, scale = quantised(convolution.weight * gain[:, None, None, None])
            x = functional.relu(norm(convolution(x)))
            scale_out = float(numpy.quantile(x.numpy(), 0.9995)) / 127
            offset = (norm.bias - norm.running_mean * gain).numpy() / scale_out
            data += (scale_in * scale / scale_out).astype("<f4").tobytes()
            data += offset.astype("<f4").tobytes()
            data += weights.transpose(0, 2, 3, 1).tobytes()  # rows of (dy, dx, channel)
            scale_in = scale_out
        by_channel = network.linear.weight.reshape(BITS, CHANNELS[-1], 4, 4)
        weights, scale = quantised(by_channel.permute(0, 2, 3, 1).reshape(BITS, -1))
        thresholds = numpy.ceil(network.balance.running_mean.numpy() / (scale_in * scale))
        data += thresholds.astype("<i4").tobytes() + weights.tobytes()
    return data + struct.pack("<I", checksum(data))
