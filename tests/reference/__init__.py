"""An independent reading of PEER Report 2017/07 in plain vectors: what the generated code is tested against."""
