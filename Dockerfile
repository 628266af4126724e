# All that a job needs: docker build -t hobble . Then snakemake --sdm apptainer ...
FROM python:3.11-slim
WORKDIR /hobble
COPY pyproject.toml constraints.txt setup.py README.md ./
COPY src src
COPY config/skeletons config/skeletons
RUN pip install --no-cache-dir --constraint constraints.txt ".[onnx,workflow]"
WORKDIR /project
