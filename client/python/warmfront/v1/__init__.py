# SPDX-License-Identifier: Apache-2.0
"""The wire contract as protoc generates it from proto/warmfront/v1: not for callers."""
